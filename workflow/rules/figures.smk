# All figures of a chapter in one job, as PNG (for the report) and SVG.

if "chapter_2" in STUDIES:

    rule figures_chapter_2:
        input:
            config=str(ROOT / settings.studies["chapter_2"]),
            records=f"{RESULTS}/chapter_2/records/physical.nc",
            spectra=f"{RESULTS}/chapter_2/spectra/physical.nc",
            thesis_spectra=f"{RESULTS}/chapter_2/spectra/thesis.nc",
            bias=f"{RESULTS}/chapter_2/bias.nc",
            weight_dominance=f"{RESULTS}/chapter_2/weight_dominance.nc",
            stability=f"{RESULTS}/chapter_2/stability.nc",
            monte_carlo=[
                f"{RESULTS}/chapter_2/monte_carlo/physical/{file_name(case)}.nc" for case in STUDIES["chapter_2"].cases
            ],
            monte_carlo_thesis=[
                f"{RESULTS}/chapter_2/monte_carlo/thesis/{file_name(case)}.nc" for case in STUDIES["chapter_2"].cases
            ],
            published=PUBLISHED,
        output:
            png=captioned("chapter_2"),
            svg=pictures("chapter_2", "svg"),
        params:
            code=code("figures.py", "rotorstudy.studies.config.load_study", "thesis.figures.chapter_2.figures"),
            load="rotorstudy.studies.config.load_study",
            function="thesis.figures.chapter_2.figures",
            reference=published_folder,
        log:
            f"{RESULTS}/logs/chapter_2/figures.log",
        script:
            "../scripts/figures.py"


if "chapter_4" in STUDIES:

    rule figures_chapter_4:
        input:
            config=str(ROOT / settings.studies["chapter_4"]),
            records=f"{RESULTS}/chapter_4/records/physical.nc",
            spectra=f"{RESULTS}/chapter_4/spectra/physical.nc",
            thesis_spectra=f"{RESULTS}/chapter_4/spectra/thesis.nc",
            bias=f"{RESULTS}/chapter_4/bias.nc",
            weight_dominance=f"{RESULTS}/chapter_4/weight_dominance.nc",
            stability=f"{RESULTS}/chapter_4/stability.nc",
            whirl=f"{RESULTS}/chapter_4/whirl.nc",
            identifiability=f"{RESULTS}/chapter_4/identifiability.nc",
            monte_carlo=f"{RESULTS}/chapter_4/monte_carlo/physical/20_to_50_Hz.nc",
            monte_carlo_thesis=f"{RESULTS}/chapter_4/monte_carlo/thesis/20_to_50_Hz.nc",
            published=PUBLISHED,
        output:
            png=captioned("chapter_4"),
            svg=pictures("chapter_4", "svg"),
        params:
            code=code("figures.py", "rotorstudy.studies.config.load_study", "thesis.figures.chapter_4.figures"),
            load="rotorstudy.studies.config.load_study",
            function="thesis.figures.chapter_4.figures",
            reference=published_folder,
        log:
            f"{RESULTS}/logs/chapter_4/figures.log",
        script:
            "../scripts/figures.py"


if "chapter_6" in STUDIES:

    rule figures_chapter_6:
        input:
            config=str(ROOT / settings.studies["chapter_6"]),
            records=f"{RESULTS}/chapter_6/records/physical.nc",
            spectra=f"{RESULTS}/chapter_6/spectra/physical.nc",
            thesis_spectra=f"{RESULTS}/chapter_6/spectra/thesis.nc",
            bias=f"{RESULTS}/chapter_6/bias.nc",
            weight_dominance=f"{RESULTS}/chapter_6/weight_dominance.nc",
            stability=f"{RESULTS}/chapter_6/stability.nc",
            whirl=f"{RESULTS}/chapter_6/whirl.nc",
            identifiability=f"{RESULTS}/chapter_6/identifiability.nc",
            sensors=f"{RESULTS}/chapter_6/sensors.nc",
            variants=f"{RESULTS}/chapter_6/variants.nc",
            monte_carlo=[
                f"{RESULTS}/chapter_6/monte_carlo/physical/{file_name(case)}.nc" for case in STUDIES["chapter_6"].cases
            ],
            published=PUBLISHED,
        output:
            png=captioned("chapter_6"),
            svg=pictures("chapter_6", "svg"),
        params:
            code=code("figures.py", "rotorstudy.studies.config.load_study", "thesis.figures.chapter_6.figures"),
            load="rotorstudy.studies.config.load_study",
            function="thesis.figures.chapter_6.figures",
            reference=published_folder,
        log:
            f"{RESULTS}/logs/chapter_6/figures.log",
        script:
            "../scripts/figures.py"


for name in REPLAYS:

    rule:
        name:
            f"figures_{name}"
        input:
            config=str(ROOT / settings.replays[name]),
            records=f"{RESULTS}/{name}/records.nc",
            spectra=f"{RESULTS}/{name}/spectra.nc",
            identification=f"{RESULTS}/{name}/identification.nc",
            published=PUBLISHED,
        output:
            png=captioned(name),
            svg=pictures(name, "svg"),
        params:
            code=code("figures.py", "thesis.config.load_replay", "thesis.figures.replays.figures"),
            load="thesis.config.load_replay",
            function="thesis.figures.replays.figures",
            reference=published_folder,
        priority: 2 # the first figures, within half a minute
        log:
            f"{RESULTS}/logs/{name}/figures.log",
        script:
            "../scripts/figures.py"
