from rotorstudy.studies.workflow import index_page, job

with job(snakemake):
    import pandas as pd

    from rotorstudy.presentation.pages import to_index
    from rotorstudy.presentation.tables import write_csv, write_html
    from thesis.scoreboard import COLUMNS, STATUSES
    from thesis.tables import in_table_order

    scored = pd.concat([pd.read_csv(path, dtype={"table": str, "item": str}) for path in snakemake.input.scored])
    scored = in_table_order(scored[COLUMNS])
    computed, measured = (scored[scored.origin == origin] for origin in ("computed anew", "measured again"))

    def reproduced(rows):
        return (rows.status == "reproduced").sum()

    counts = scored.groupby(["table", "status"], sort=False).size().unstack(fill_value=0)
    counts = counts.reindex(columns=list(STATUSES), fill_value=0).reset_index()
    counts.insert(1, "values", counts[list(STATUSES)].sum(axis=1))
    write_csv(scored, snakemake.output.csv)
    write_html(
        snakemake.output.html,
        "Scoreboard",
        f"Of {len(computed)} printed values that are computed anew, {reproduced(computed)} are reproduced within one "
        f"unit of their last digit. Another {len(measured)} are measurements: replayed as records and measured again, "
        f"{reproduced(measured)} are reproduced, which checks the measuring chain. Every other value has a reason.",
        {"Every value": scored, "Number of values by table": counts},
        choose=("table", "quantity", "method", "origin", "status"),
        below="reason",
        links=to_index(snakemake.output.html, index_page(snakemake)),
    )
