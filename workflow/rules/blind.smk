# Blind tests: effects hidden in simulated measurements, diagnosed without the truth.
if BLIND:

    rule blind:
        input:
            config=str(ROOT / settings.blind),
            independent=[str(ROOT / settings.independent_records)] if settings.independent_records else [],
            plugins=sorted(
                {plugin.file for kind, plugin in registry() if kind in ("rotor", "crack", "bearing", "effect")}
            ),
        output:
            data=f"{BLIND_RESULTS}/blind.nc",
            sealed=[f"{BLIND_RESULTS}/{name}.json" for name in ("seals", "truths", "verdicts")],
            sheets=[f"{BLIND_RESULTS}/{name}.csv" for name in [*BLIND_PAGES, "answers"]],
            pages=[
                in_report(f"{BLIND_RESULTS}/{name}.html", f"blind_{name}", "Blind tests", "Tables")
                for name in BLIND_PAGES
            ],
            png=[
                in_report(f"{BLIND_RESULTS}/figures/{name}.png", f"blind_{name}", "Blind tests", "Figures")
                for name in BLIND_FIGURES
            ],
            svg=[f"{BLIND_RESULTS}/figures/{name}.svg" for name in BLIND_FIGURES],
        threads: 8 # at most
        params:
            code=code("blind.py"),
        log:
            f"{RESULTS}/logs/blind.log",
        script:
            "../scripts/blind.py"
