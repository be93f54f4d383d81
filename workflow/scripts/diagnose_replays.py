from rotorstudy.job import job

with job(snakemake):
    import json
    from pathlib import Path

    import pandas as pd

    from rotorstudy.diagnosis.page import chance, place
    from rotorstudy.store import load
    from rotorstudy.studies.left_out import harmonic_rows, parameter_rows
    from rotorstudy.studies.replay import load_replay
    from rotorstudy.tables import write_csv, write_html

    reference = Path(snakemake.input.published).parent
    harmonics, left_out, parameters, notes, found = [], [], [], [], {}
    for path, told, values, left in zip(
        snakemake.input.configs, snakemake.input.verdicts, snakemake.input.data, snakemake.input.left_out, strict=True
    ):
        config, verdict, data = load_replay(path), json.loads(Path(told).read_text()), load(values)
        rig, rows = config.name.replace("_", " "), json.loads(Path(left).read_text())
        worst = harmonic_rows(config, data, reference)
        harmonics += worst
        parameters += parameter_rows(config, data, reference)
        left_out += [
            {
                "rig": rig,
                "speed left out (Hz)": row["speed"] / 6.283185307179586,
                "verdict": row["verdict"],
                "causes": "; ".join(row["causes"]),
                **{
                    f"{name.replace('_', ' ')} (µm)": 1e6 * row[name] for name in ("without_limits", "base", "extended")
                },
            }
            for row in rows
        ]
        wrong = sorted(worst, key=lambda row: -row["base (σ)"])[:4]
        where = ", ".join(
            f"{row['harmonic']} by {row['base, left (µm)']:.3g} µm ({row['base (σ)']:.2g} σ)" for row in wrong
        )
        named = [place(cause) for cause in verdict["causes"]]
        found[rig] = set(named) | {place(cause) for cause in verdict["ambiguous_with"]}
        better = sum(row["extended"] < row["base"] for row in rows)
        always = set.intersection(*(set(row["causes"]) for row in rows))
        before, after = (chance(verdict["chance_of_residual"][when]) for when in ("before", "after"))
        notes += [
            f"{rig}: within what its impact tests allow, the thesis's model misses most at {where}; chance of that by noise: "
            f"{before}.",
            f"{rig}, verdict '{verdict['verdict']}': {verdict['in_words']} Chance of what is left: {after}.",
            f"{rig}: of {len(rows)} speeds left out, {better} are foretold better with causes than without. "
            f"Found whichever speed is left out: {', '.join(sorted(always)) or 'nothing'}.",
        ]
    shared = set.intersection(*found.values())
    notes += [
        f"In both rigs, as cause or not ruled out: {', '.join(sorted(shared)) or 'nothing'}.",
        "Thesis, left: with its own estimates from all speeds, 0X and 1X of the slow roll taken off as in Eq. (3.1). Base: "
        "its model, with dampings, crack and disc within what its impact tests and a lathe allow. Without limits: its model, "
        "every parameter free.",
    ]
    tables = {name: pd.DataFrame(rows) for name, rows in zip(
        ("Harmonics", "Each speed left out (rms over the harmonics)", "The thesis's estimates"),
        (harmonics, left_out, parameters), strict=True,
    )}  # fmt: skip
    for table, sheet in zip(tables.values(), snakemake.output.csv, strict=True):
        write_csv(table, sheet)
    cannot = [
        "What three or four speeds of one probe pair cannot decide. On a rotor of one coordinate a bow and a force at 1X that "
        "does not grow with the speed are the same response, here, at every speed; an uncoupled run tells.",
        "All higher speeds lie between a quarter and two fifths of the critical speed: an unbalance grows there by the square of "
        "the speed and a bow by its resonance, but a runout that is not the same at all speeds looks like either. A "
        "coast-down through the critical speed tells.",
        "A mirror image of 1X at -1X may be unequal or skewed probes, a runout, or anisotropy of the supports: exchange the "
        "two probes, or turn both by 45 degrees.",
        "0X is nearly all sensor gap, and the gap is known to no better than its drift; so the side force by which 0X would "
        "tell internal damping is below the stated error.",
        "Noise beyond the rounding was never published. 1 µm and 5 % of each harmonic are assumed; with rounding alone every "
        "harmonic would be significant and nothing explained.",
    ]
    write_html(snakemake.output.html, "What the thesis's model gets wrong on its own measurements", [notes[0], *notes[1:], *cannot],
               tables, digits=3)  # fmt: skip
