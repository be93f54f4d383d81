from rotorstudy.job import job

with job(snakemake):
    import pandas as pd

    from rotorstudy.scoreboard import COLUMNS
    from rotorstudy.tables import write_csv, write_html

    scored = pd.concat([pd.read_csv(path, dtype={"table": str, "item": str}) for path in snakemake.input.scored])
    scored = scored[COLUMNS]
    replayed = scored.table.isin(["3.4", "3.5", "3.6", "3.7", "3.8"])  # printed values through the measuring chain
    computed, measured = scored[~replayed], scored[replayed]

    def reproduced(rows):
        return (rows.status == "reproduced").sum()

    counts = scored.groupby(["table", "status"], sort=False).size().unstack(fill_value=0).reset_index()
    write_csv(scored, snakemake.output.csv)
    write_html(
        snakemake.output.html,
        "Scoreboard",
        f"Of {len(computed)} printed values that are computed anew, {reproduced(computed)} are reproduced within one "
        f"unit of their last digit. Another {len(measured)} (Tables 3.4 to 3.8) are measurements: replayed as records "
        f"and measured again, {reproduced(measured)} come back, which checks the measuring chain. Every other value "
        "has a reason. Chapters 4 to 6 are not done yet.",
        {
            "How many": counts,
            "Values that are not reproduced to the digit": scored[scored.status != "reproduced"],
            "All": scored,
        },
    )
