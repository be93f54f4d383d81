# Tables of each chapter beside the thesis's, and the scoreboard over all of them.

for name in CHAPTERS:

    rule:
        name:
            f"tables_{name}"
        input:
            config=chapter_config(name),
            published=PUBLISHED,
            reasons=f"{REFERENCE}/reasons.yaml",
            **table_inputs(name),
        output:
            scored=f"{RESULTS}/{name}/scored.csv",
            csv=table_sheets(name),
            html=table_pages(name),
        params:
            code=code("tables.py", loader(name), f"thesis.{module(name, 'replay_tables')}.tables"),
            load=loader(name),
            function=f"thesis.{module(name, 'replay_tables')}.tables",
            reference=published_folder,
        log:
            f"{RESULTS}/logs/{name}/tables.log",
        run:
            run_script("tables.py", input, output, params, wildcards, threads, log)


rule scoreboard:
    input:
        scored=[f"{RESULTS}/{chapter}/scored.csv" for chapter in CHAPTERS],
    output:
        csv=f"{RESULTS}/scoreboard.csv",
        html=in_report(f"{RESULTS}/scoreboard.html", "scoreboard", "Scoreboard", "All chapters"),
    params:
        code=code("scoreboard.py"),
    log:
        f"{RESULTS}/logs/scoreboard.log",
    run:
        run_script("scoreboard.py", input, output, params, wildcards, threads, log)


if PAGES:

    rule errata:
        input:
            errata=f"{REFERENCE}/errata.yaml",
            published=PUBLISHED,
            chapter_2=str(ROOT / settings.studies["chapter_2"]),
            chapter_3=str(ROOT / settings.replays["chapter_3"]),
            chapter_4=str(ROOT / settings.studies["chapter_4"]),
            chapter_5=str(ROOT / settings.replays["chapter_5"]),
            chapter_6=str(ROOT / settings.studies["chapter_6"]),
            thesis_spectra=f"{RESULTS}/chapter_4/spectra/thesis.nc",
            weight_dominance=f"{RESULTS}/chapter_4/weight_dominance.nc",
            monte_carlo=f"{RESULTS}/chapter_4/monte_carlo/thesis/20_to_50_Hz.nc",
            spectra=f"{RESULTS}/chapter_5/spectra.nc",
            identification=f"{RESULTS}/chapter_5/identification.nc",
            variants=f"{RESULTS}/chapter_6/variants.nc",
        output:
            csv=f"{RESULTS}/errata.csv",
            html=in_report(f"{RESULTS}/errata.html", "errata", "Scoreboard", "All chapters"),
        params:
            code=code("errata.py"),
        log:
            f"{RESULTS}/logs/errata.log",
        run:
            run_script("errata.py", input, output, params, wildcards, threads, log)

    rule compare_rigs:
        input:
            configs=[str(ROOT / settings.replays[name]) for name in ("chapter_3", "chapter_5")],
            identification=[f"{RESULTS}/{name}/identification.nc" for name in ("chapter_3", "chapter_5")],
            spectra=[f"{RESULTS}/{name}/spectra.nc" for name in ("chapter_3", "chapter_5")],
            published=PUBLISHED,
        output:
            csv=[f"{RESULTS}/rigs/comparison.csv", f"{RESULTS}/rigs/backward_1X.csv"],
            html=[
                in_report(f"{RESULTS}/rigs/{name}.html", f"rigs_{name}", "Both rigs", "Tables")
                for name in ("comparison", "backward_1X")
            ],
            png=in_report(f"{RESULTS}/rigs/comparison.png", "rigs_comparison", "Both rigs", "Figures"),
            svg=f"{RESULTS}/rigs/comparison.svg",
        params:
            code=code("compare_rigs.py"),
        log:
            f"{RESULTS}/logs/compare_rigs.log",
        run:
            run_script("compare_rigs.py", input, output, params, wildcards, threads, log)
