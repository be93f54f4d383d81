# Tables of each chapter beside the thesis's, and the scoreboard over all of them.

if "chapter_2" in STUDIES:

    rule tables_chapter_2:
        input:
            config=str(ROOT / settings.studies["chapter_2"]),
            spectra=f"{RESULTS}/chapter_2/spectra/thesis.nc",
            identification=f"{RESULTS}/chapter_2/identification/thesis.nc",
            monte_carlo=[
                f"{RESULTS}/chapter_2/monte_carlo/thesis/{file_name(case)}.nc" for case in STUDIES["chapter_2"].cases
            ],
            published=PUBLISHED,
            reasons=f"{REFERENCE}/reasons.yaml",
        output:
            scored=f"{RESULTS}/chapter_2/scored.csv",
            csv=table_sheets("chapter_2"),
            html=table_pages("chapter_2"),
        params:
            code=code("tables.py", "rotorstudy.studies.config.load_study", "thesis.chapter_2.tables"),
            load="rotorstudy.studies.config.load_study",
            function="thesis.chapter_2.tables",
            reference=published_folder,
        log:
            f"{RESULTS}/logs/chapter_2/tables.log",
        script:
            "../scripts/tables.py"


if "chapter_4" in STUDIES:

    rule tables_chapter_4:
        input:
            config=str(ROOT / settings.studies["chapter_4"]),
            spectra=f"{RESULTS}/chapter_4/spectra/thesis.nc",
            identification=f"{RESULTS}/chapter_4/identification/thesis.nc",
            monte_carlo=f"{RESULTS}/chapter_4/monte_carlo/thesis/20_to_50_Hz.nc",
            published=PUBLISHED,
            reasons=f"{REFERENCE}/reasons.yaml",
        output:
            scored=f"{RESULTS}/chapter_4/scored.csv",
            csv=table_sheets("chapter_4"),
            html=table_pages("chapter_4"),
        params:
            code=code("tables.py", "rotorstudy.studies.config.load_study", "thesis.chapter_4.tables"),
            load="rotorstudy.studies.config.load_study",
            function="thesis.chapter_4.tables",
            reference=published_folder,
        log:
            f"{RESULTS}/logs/chapter_4/tables.log",
        script:
            "../scripts/tables.py"


if "chapter_6" in STUDIES:

    rule tables_chapter_6:
        input:
            config=str(ROOT / settings.studies["chapter_6"]),
            spectra=f"{RESULTS}/chapter_6/spectra/thesis.nc",
            variants=f"{RESULTS}/chapter_6/variants.nc",
            published=PUBLISHED,
            reasons=f"{REFERENCE}/reasons.yaml",
        output:
            scored=f"{RESULTS}/chapter_6/scored.csv",
            csv=table_sheets("chapter_6"),
            html=table_pages("chapter_6"),
        params:
            code=code("tables.py", "rotorstudy.studies.config.load_study", "thesis.chapter_6.tables"),
            load="rotorstudy.studies.config.load_study",
            function="thesis.chapter_6.tables",
            reference=published_folder,
        log:
            f"{RESULTS}/logs/chapter_6/tables.log",
        script:
            "../scripts/tables.py"


for name in REPLAYS:

    rule:
        name:
            f"tables_{name}"
        input:
            config=str(ROOT / settings.replays[name]),
            spectra=f"{RESULTS}/{name}/spectra.nc",
            identification=f"{RESULTS}/{name}/identification.nc",
            published=PUBLISHED,
            reasons=f"{REFERENCE}/reasons.yaml",
        output:
            scored=f"{RESULTS}/{name}/scored.csv",
            csv=table_sheets(name),
            html=table_pages(name),
        params:
            code=code("tables.py", "thesis.config.load_replay", "thesis.replay_tables.tables"),
            load="thesis.config.load_replay",
            function="thesis.replay_tables.tables",
            reference=published_folder,
        log:
            f"{RESULTS}/logs/{name}/tables.log",
        script:
            "../scripts/tables.py"


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
    script:
        "../scripts/scoreboard.py"


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
        script:
            "../scripts/errata.py"

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
        script:
            "../scripts/compare_rigs.py"
