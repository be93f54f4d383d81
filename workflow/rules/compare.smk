# Every spectrum method with every estimator of the plugin library. A new estimator reuses existing spectra.
if COMPARISON:

    for chunk in range(COMPARE_CHUNKS):

        rule:
            name:
                f"compare_spectra_{chunk}"
            input:
                sources=compared_sources(),
                config=str(ROOT / settings.compare),
                plugins=compared_plugins(),
                method=method_file("spectrum", "method"),
            output:
                [f"{compare_chunk(chunk)}/spectra/{rotor}/{{method}}.nc" for rotor in ROTORS],
            params:
                code=code("compare_spectra.py"),
                sources={name: compared_source(c) for name, c in COMPARISON.rotors.items()},
                chunk=(chunk, COMPARE_CHUNKS),
            log:
                f"{RESULTS}/logs/compare/spectra_{{method}}_{chunk}.log",
            run:
                run_script("compare_spectra.py", input, output, params, wildcards, threads, log)

        # the first chunk also has the errors by wrong known quantities: in separate jobs the start of Python would dominate
        rule:
            name:
                f"compare_estimates_{chunk}"
            input:
                sources=compared_sources(),
                config=str(ROOT / settings.compare),
                spectra=[
                    f"{compare_chunk(chunk)}/spectra/{rotor}/{method}.nc" for rotor in ROTORS for method in METHODS
                ],
                plugins=compared_plugins(),
                estimator=method_file("estimator", "estimator"),
            output:
                estimates=[f"{compare_chunk(chunk)}/estimates/{rotor}/{{estimator}}.nc" for rotor in ROTORS],
                bias=[f"{COMPARE}/bias/{rotor}/{{estimator}}.nc" for rotor in BIASED if chunk == 0],
            params:
                code=code("compare_estimates.py"),
                sources={name: compared_source(c) for name, c in COMPARISON.rotors.items()},
            log:
                f"{RESULTS}/logs/compare/estimates_{{estimator}}_{chunk}.log",
            run:
                run_script("compare_estimates.py", input, output, params, wildcards, threads, log)

    rule compare:
        input:
            config=str(ROOT / settings.compare),
            spectra=compared_of_chunks("spectra", METHODS),
            estimates=compared_of_chunks("estimates", ESTIMATORS),
            bias=[f"{COMPARE}/bias/{rotor}/{estimator}.nc" for rotor in BIASED for estimator in ESTIMATORS],
        output:
            comparison=f"{COMPARE}/comparison.nc",
            ranking=f"{COMPARE}/ranking.csv",
            ranking_page=in_report(f"{COMPARE}/ranking.html", "compare_ranking", "Comparison", "Tables"),
            advice=f"{COMPARE}/advice.csv",
            advice_page=in_report(f"{COMPARE}/advice.html", "compare_advice", "Comparison", "Tables"),
            png=captioned("compare", "Comparison"),
            svg=pictures("compare", "svg"),
        params:
            code=code("compare.py"),
        log:
            f"{RESULTS}/logs/compare/compare.log",
        run:
            run_script("compare.py", input, output, params, wildcards, threads, log)
