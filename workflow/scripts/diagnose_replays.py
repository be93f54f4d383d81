from rotorstudy.studies.workflow import job

with job(snakemake):
    import json
    from pathlib import Path

    import pandas as pd

    from rotorstudy.presentation.tables import write_csv, write_html
    from rotorstudy.store import load
    from rotorstudy.thesis.config import load_replay
    from rotorstudy.thesis.left_out import (
        LEGEND,
        UNDECIDED,
        changed_estimates,
        harmonic_rows,
        impossible_dampings,
        in_short,
        left_out_rows,
        notes_on,
        parameter_rows,
        shared_causes,
    )

    reference = Path(snakemake.input.published).parent
    harmonics, left_out, parameters, notes, verdicts = [], [], [], [], {}
    for path, told, values, left in zip(
        snakemake.input.configs, snakemake.input.verdicts, snakemake.input.data, snakemake.input.left_out, strict=True
    ):
        config, data = load_replay(path), load(values)
        verdicts[config.name] = json.loads(Path(told).read_text())
        rows, wrong = json.loads(Path(left).read_text()), harmonic_rows(config, data, reference)
        harmonics += wrong
        left_out += left_out_rows(config, rows)
        parameters += parameter_rows(config, data, reference)
        notes += notes_on(config, verdicts[config.name], wrong, rows)
    headings = ("Harmonics", "Each speed left out, rms over the harmonics", "The thesis's estimates")
    tables = [pd.DataFrame(rows) for rows in (harmonics, left_out, parameters)]
    for table, sheet in zip(tables, snakemake.output.csv, strict=True):
        write_csv(table, sheet)
    write_html(
        snakemake.output.html,
        "What the thesis's model gets wrong on its own measurements",
        [
            in_short(verdicts, harmonics),
            LEGEND,
            *notes,
            shared_causes(verdicts),
            *impossible_dampings(parameters),
            *changed_estimates(parameters),
            UNDECIDED[0],
            *(f"Not decided either: {text}" for text in UNDECIDED[1:]),
        ],
        dict(zip(headings, tables, strict=True)),
        digits=3,
    )
