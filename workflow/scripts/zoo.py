from rotorstudy.studies.workflow import job

with job(snakemake):
    import pandas as pd

    from rotorstudy.authoring.facts import page, tables
    from rotorstudy.presentation.tables import write_csv, write_html

    found = tables()
    count = sum(len(table) for table in found.values())
    write_csv(pd.concat([table.assign(kind=kind) for kind, table in found.items()]), snakemake.output.csv)
    write_html(
        snakemake.output.html,
        "The zoo",
        f"{count} models, each one file in plugins/. Every claim is verified by the tests and by `rotorstudy check`. "
        "An option marked (needed) has no default. zoo.csv has a column for each fact.",
        {f"{kind} ({len(table)})": page(table) for kind, table in found.items()},
    )
