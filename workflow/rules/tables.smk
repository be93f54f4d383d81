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
            published=f"{REFERENCE}/identified_parameters.csv",
            reasons=f"{REFERENCE}/reasons.yaml",
            code=code("tables_chapter_2.py"),
        output:
            scored=f"{RESULTS}/chapter_2/scored.csv",
            csv=table_sheets("chapter_2"),
            html=table_pages("chapter_2"),
        log:
            f"{RESULTS}/logs/chapter_2/tables.log",
        script:
            "../scripts/tables_chapter_2.py"


if "chapter_4" in STUDIES:

    rule tables_chapter_4:
        input:
            config=str(ROOT / settings.studies["chapter_4"]),
            spectra=f"{RESULTS}/chapter_4/spectra/thesis.nc",
            identification=f"{RESULTS}/chapter_4/identification/thesis.nc",
            monte_carlo=f"{RESULTS}/chapter_4/monte_carlo/thesis/20_to_50_Hz.nc",
            published=f"{REFERENCE}/identified_parameters.csv",
            reasons=f"{REFERENCE}/reasons.yaml",
            code=code("tables_chapter_4.py"),
        output:
            scored=f"{RESULTS}/chapter_4/scored.csv",
            csv=table_sheets("chapter_4"),
            html=table_pages("chapter_4"),
        log:
            f"{RESULTS}/logs/chapter_4/tables.log",
        script:
            "../scripts/tables_chapter_4.py"


if "chapter_3" in REPLAYS:

    rule tables_chapter_3:
        input:
            config=str(ROOT / settings.replays["chapter_3"]),
            spectra=f"{RESULTS}/chapter_3/spectra.nc",
            identification=f"{RESULTS}/chapter_3/identification.nc",
            published=f"{REFERENCE}/full_spectrum.csv",
            reasons=f"{REFERENCE}/reasons.yaml",
            code=code("tables_chapter_3.py"),
        output:
            scored=f"{RESULTS}/chapter_3/scored.csv",
            csv=table_sheets("chapter_3"),
            html=table_pages("chapter_3"),
        log:
            f"{RESULTS}/logs/chapter_3/tables.log",
        script:
            "../scripts/tables_chapter_3.py"


rule scoreboard:
    input:
        scored=[f"{RESULTS}/{chapter}/scored.csv" for chapter in CHAPTERS],
        code=code("scoreboard.py"),
    output:
        csv=f"{RESULTS}/scoreboard.csv",
        html=in_report(f"{RESULTS}/scoreboard.html", "scoreboard", "Scoreboard", "All chapters"),
    log:
        f"{RESULTS}/logs/scoreboard.log",
    script:
        "../scripts/scoreboard.py"
