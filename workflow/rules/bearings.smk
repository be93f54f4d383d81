# Stiffness and damping over speed of every bearing of the plugin library, one row each.
rule bearings:
    input:
        plugins=plugin_files([], registry().plugins["bearing"].values()),
    output:
        data=f"{RESULTS}/bearings/coefficients.nc",
        png=in_report(
            f"{RESULTS}/bearings/coefficients.png",
            "bearings_coefficients",
            "Bearing models",
            "Figures",
        ),
        svg=f"{RESULTS}/bearings/coefficients.svg",
    params:
        code=code("bearings.py"),
    log:
        f"{RESULTS}/logs/bearings.log",
    run:
        run_script("bearings.py", input, output, params, wildcards, threads, log)
