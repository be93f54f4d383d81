from rotorstudy.studies.workflow import index_page, job

with job(snakemake):
    from pathlib import Path

    import yaml

    from rotorstudy.presentation.pages import to_index
    from rotorstudy.presentation.tables import write_csv, write_html
    from rotorstudy.store import load
    from rotorstudy.studies.config import load_study
    from thesis import errata
    from thesis.config import load_replay
    from thesis.errata_chapter_4 import chapter_4
    from thesis.errata_chapter_6 import chapter_6

    given = snakemake.input
    reference = Path(given.errata).parent
    numbers = errata.chapter_2(load_study(given.chapter_2), reference)
    numbers |= errata.chapter_3(load_replay(given.chapter_3), reference)
    numbers |= chapter_4(
        load_study(given.chapter_4),
        reference,
        load(given.thesis_spectra),
        load(given.weight_dominance),
        load(given.monte_carlo),
    )
    numbers |= errata.chapter_5(load_replay(given.chapter_5), load(given.spectra), load(given.identification))
    numbers |= chapter_6(load_study(given.chapter_6), reference, load(given.variants))
    table = errata.filled(yaml.safe_load(Path(given.errata).read_text(encoding="utf-8")), numbers)
    write_csv(table, snakemake.output.csv)
    write_html(
        snakemake.output.html,
        "Errata of the thesis, Chapters 2 to 6",
        "Each with evidence computed by this workflow: what is reproduced, or changes, if the printed form is used.",
        {"": table},
        links=to_index(snakemake.output.html, index_page(snakemake)),
    )
