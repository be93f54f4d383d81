# Effects hidden in simulated measurements, diagnosed without the truth: in chunks, gathered into one array.
if BLIND:

    rule blind_chunk:
        input:
            config=str(ROOT / settings.blind),
            plugins=sorted(
                {plugin.file for kind, plugin in registry() if kind in ("rotor", "crack", "bearing", "effect")}
            ),
        output:
            seals=f"{BLIND_RESULTS}/chunks/{{chunk}}/seals.json",
            answers=f"{BLIND_RESULTS}/chunks/{{chunk}}/answers.json",
        threads: 8 if settings.chunks.blind == 1 else 1 # at most
        params:
            code=code("blind_chunk.py"),
            chunks=settings.chunks.blind,
        log:
            f"{RESULTS}/logs/blind/{{chunk}}.log",
        run:
            run_script("blind_chunk.py", input, output, params, wildcards, threads, log)

    rule blind:
        input:
            config=str(ROOT / settings.blind),
            independent=[str(ROOT / settings.independent_records)] if settings.independent_records else [],
            seals=[f"{BLIND_RESULTS}/chunks/{i}/seals.json" for i in range(settings.chunks.blind)],
            answers=[f"{BLIND_RESULTS}/chunks/{i}/answers.json" for i in range(settings.chunks.blind)],
        output:
            data=f"{BLIND_RESULTS}/blind.nc",
            sealed=[f"{BLIND_RESULTS}/{name}.json" for name in ("seals", "truths", "verdicts")],
            sheets=[f"{BLIND_RESULTS}/{name}.csv" for name in BLIND_PAGES],
            pages=[
                in_report(f"{BLIND_RESULTS}/{name}.html", f"blind_{name}", "Blind tests", "Tables")
                for name in BLIND_PAGES
            ],
            png=captioned("blind", "Blind tests"),
            svg=pictures("blind", "svg"),
        params:
            code=code("blind.py"),
        log:
            f"{RESULTS}/logs/blind.log",
        run:
            run_script("blind.py", input, output, params, wildcards, threads, log)
