from rotorstudy.job import job

with job(snakemake):
    import pandas as pd

    from rotorstudy.scoreboard import COLUMNS
    from rotorstudy.tables import write_csv, write_html

    scored = pd.concat([pd.read_csv(path, dtype={"table": str, "item": str}) for path in snakemake.input.scored])
    scored = scored[COLUMNS]
    counts = scored.groupby(["table", "status"], sort=False).size().unstack(fill_value=0).reset_index()
    write_csv(scored, snakemake.output.csv)
    write_html(
        snakemake.output.html,
        "Scoreboard",
        f"{(scored.status == 'reproduced').sum()} of {len(scored)} printed values are reproduced within one unit of "
        "their last digit. Every other one has a reason that can be checked.",
        {
            "How many": counts,
            "Values that are not reproduced to the digit": scored[scored.status != "reproduced"],
            "All": scored,
        },
    )
