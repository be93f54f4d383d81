# Every spectrum method with every estimator of the plugin library. A new estimator reuses existing spectra.
if COMPARISON:

    rule compare_spectra:
        input:
            sources=compared_sources(),
            config=str(ROOT / settings.compare),
            plugins=compared_plugins(),
            method=method_file("spectrum", "method"),
        output:
            [f"{COMPARE}/spectra/{rotor}/{{method}}.nc" for rotor in ROTORS],
        params:
            code=code("compare_spectra.py"),
            sources={name: compared_source(c) for name, c in COMPARISON.rotors.items()},
        log:
            f"{RESULTS}/logs/compare/spectra_{{method}}.log",
        script:
            "../scripts/compare_spectra.py"

    # also the errors by wrong known quantities: in separate jobs the start of Python would dominate
    rule compare_estimates:
        input:
            sources=compared_sources(),
            config=str(ROOT / settings.compare),
            spectra=[f"{COMPARE}/spectra/{rotor}/{method}.nc" for rotor in ROTORS for method in METHODS],
            plugins=compared_plugins(),
            estimator=method_file("estimator", "estimator"),
        output:
            estimates=[f"{COMPARE}/estimates/{rotor}/{{estimator}}.nc" for rotor in ROTORS],
            bias=[f"{COMPARE}/bias/{rotor}/{{estimator}}.nc" for rotor in BIASED],
        params:
            code=code("compare_estimates.py"),
            sources={name: compared_source(c) for name, c in COMPARISON.rotors.items()},
        log:
            f"{RESULTS}/logs/compare/estimates_{{estimator}}.log",
        script:
            "../scripts/compare_estimates.py"

    rule compare:
        input:
            config=str(ROOT / settings.compare),
            spectra=[f"{COMPARE}/spectra/{rotor}/{method}.nc" for rotor in ROTORS for method in METHODS],
            estimates=[f"{COMPARE}/estimates/{rotor}/{estimator}.nc" for rotor in ROTORS for estimator in ESTIMATORS],
            bias=[f"{COMPARE}/bias/{rotor}/{estimator}.nc" for rotor in BIASED for estimator in ESTIMATORS],
        output:
            comparison=f"{COMPARE}/comparison.nc",
            ranking=f"{COMPARE}/ranking.csv",
            ranking_page=in_report(f"{COMPARE}/ranking.html", "compare_ranking", "Comparison", "Tables"),
            advice=f"{COMPARE}/advice.csv",
            advice_page=in_report(f"{COMPARE}/advice.html", "compare_advice", "Comparison", "Tables"),
            png=[
                in_report(f"{COMPARE}/figures/{name}.png", f"compare_{name}", "Comparison", "Figures")
                for name in COMPARISON_FIGURES
            ],
            svg=[f"{COMPARE}/figures/{name}.svg" for name in COMPARISON_FIGURES],
        params:
            code=code("compare.py"),
        log:
            f"{RESULTS}/logs/compare/compare.log",
        script:
            "../scripts/compare.py"
