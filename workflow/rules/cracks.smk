# Crack models side by side: every crack and every depth plugin of the library on one rotor.

if settings.cracks:

    rule cracks:
        input:
            config=str(ROOT / settings.cracks),
            plugins=plugin_files([CRACKS.base], [p for kind, p in registry() if kind in ("crack", "depth")]),
        output:
            f"{RESULTS}/cracks/comparison.nc",
        params:
            code=code("cracks.py"),
        log:
            f"{RESULTS}/logs/cracks/comparison.log",
        run:
            run_script("cracks.py", input, output, params, wildcards, threads, log)

    rule figures_cracks:
        input:
            config=str(ROOT / settings.cracks),
            comparison=rules.cracks.output[0],
        output:
            png=captioned("cracks", "Crack models"),
            svg=pictures("cracks", "svg"),
        params:
            code=code(
                "figures.py", "rotorstudy.studies.cracks.load_cracks", "rotorstudy.presentation.crack_figures.figures"
            ),
            load="rotorstudy.studies.cracks.load_cracks",
            function="rotorstudy.presentation.crack_figures.figures",
        log:
            f"{RESULTS}/logs/cracks/figures.log",
        run:
            run_script("figures.py", input, output, params, wildcards, threads, log)
