# Diagnoses of measured records: one folder each, and a page on the replayed experiments.
rule diagnose:
    input:
        unpack(diagnosed),
        plugins=EFFECTS,
    output:
        verdict=f"{DIAGNOSIS}/{{diagnosis}}/verdict.json",
        data=f"{DIAGNOSIS}/{{diagnosis}}/verdict.nc",
        rig=f"{DIAGNOSIS}/{{diagnosis}}/extended_rig.yaml",
        page=in_report(f"{DIAGNOSIS}/{{diagnosis}}/index.html", "diagnosis_index", "Diagnoses", "Pages"),
        png=captioned("diagnosis", "Diagnoses", folder=f"{DIAGNOSIS}/{{diagnosis}}"),
        svg=pictures("diagnosis", "svg", folder=f"{DIAGNOSIS}/{{diagnosis}}"),
    params:
        code=code("diagnose.py"),
    log:
        f"{RESULTS}/logs/diagnosis/{{diagnosis}}.log",
    run:
        run_script("diagnose.py", input, output, params, wildcards, threads, log)


if REPLAYED:

    rule diagnose_left_out:
        input:
            unpack(diagnosed),
            plugins=EFFECTS,
        output:
            f"{DIAGNOSIS}/{{diagnosis}}/left_out.json",
        params:
            code=code("diagnose_left_out.py"),
        log:
            f"{RESULTS}/logs/diagnosis/{{diagnosis}}_left_out.log",
        run:
            run_script("diagnose_left_out.py", input, output, params, wildcards, threads, log)

    rule diagnose_replays:
        input:
            configs=[str(ROOT / settings.replays[settings.diagnoses[name].replay]) for name in REPLAYED],
            verdicts=[f"{DIAGNOSIS}/{name}/verdict.json" for name in REPLAYED],
            data=[f"{DIAGNOSIS}/{name}/verdict.nc" for name in REPLAYED],
            left_out=[f"{DIAGNOSIS}/{name}/left_out.json" for name in REPLAYED],
            published=f"{REFERENCE}/identified_parameters.csv",
        output:
            csv=[f"{DIAGNOSIS}/replays_{sheet}.csv" for sheet in REPLAY_SHEETS],
            html=in_report(f"{DIAGNOSIS}/replays.html", "diagnosis_replays", "Diagnoses", "Pages"),
        params:
            code=code("diagnose_replays.py"),
        log:
            f"{RESULTS}/logs/diagnosis/replays.log",
        run:
            run_script("diagnose_replays.py", input, output, params, wildcards, threads, log)
