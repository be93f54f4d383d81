from rotorstudy.studies.workflow import index_page, job

with job(snakemake):
    from pathlib import Path

    from rotorstudy.presentation.plots import save_figure
    from rotorstudy.presentation.tables import write_tables
    from rotorstudy.store import load
    from thesis.backward_1x import backward_1x_table
    from thesis.config import load_replay
    from thesis.figures.rigs import rigs_figure
    from thesis.rigs import rigs_table

    given = zip(snakemake.input.configs, snakemake.input.identification, snakemake.input.spectra, strict=True)
    replays = [(load_replay(path), load(found), load(seen)) for path, found, seen in given]
    table = rigs_table(replays, Path(snakemake.input.published[0]).parent)
    tables = {"comparison": table, "backward_1X": backward_1x_table(replays)}
    write_tables(tables, [*snakemake.output.csv, *snakemake.output.html], index_page(snakemake))
    save_figure(rigs_figure(replays, table.rows), snakemake.output.png, snakemake.output.svg)
