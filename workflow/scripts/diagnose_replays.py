from rotorstudy.studies.workflow import index_page, job

with job(snakemake):
    from pathlib import Path

    import pandas as pd

    from rotorstudy.presentation.pages import to_index
    from rotorstudy.presentation.tables import write_csv, write_html
    from thesis.replays_page import SHEETS, replays_page

    folders = [Path(path).parent for path in snakemake.input.verdicts]
    rows, notes = replays_page(snakemake.input.configs, folders, Path(snakemake.input.published).parent)
    tables = {name: pd.DataFrame(rows[name]) for name in SHEETS}
    for path in map(Path, snakemake.output.csv):
        write_csv(tables[path.stem.removeprefix("replays_")], path)
    title = "Residuals of the thesis's model on its own measurements"
    shown = {SHEETS[name]: table for name, table in tables.items()}
    links = to_index(snakemake.output.html, index_page(snakemake))
    write_html(snakemake.output.html, title, notes, shown, digits=3, links=links)
