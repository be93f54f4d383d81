# Chapter 7, our own: transverse cracks, how small they are detected and how accurately they are found.

if CRACK_STUDY:

    rule crack_study:
        input:
            config=str(ROOT / settings.crack_study),
            plugins=plugin_files(
                [rotor.model_dump(include={"rotor", "bearings", "effects"}) for rotor in CRACK_STUDY.rotors.values()],
                [registry().get("effect", CRACK_STUDY.crack.kind), *registry().plugins["depth"].values()],
            ),
        output:
            **{stage: f"{RESULTS}/{CRACK_STUDY.name}/{stage}.nc" for stage in CRACK_STAGES},
        params:
            code=code("crack_study.py", *CRACK_STAGES.values()),
            functions=CRACK_STAGES,
        log:
            f"{RESULTS}/logs/{CRACK_STUDY.name}/study.log",
        run:
            run_script("crack_study.py", input, output, params, wildcards, threads, log)

    rule figures_crack_study:
        input:
            config=str(ROOT / settings.crack_study),
            **dict(rules.crack_study.output.items()),
        output:
            png=captioned("chapter_7", "Transverse cracks", folder=f"{RESULTS}/{CRACK_STUDY.name}"),
            svg=pictures("chapter_7", "svg", folder=f"{RESULTS}/{CRACK_STUDY.name}"),
        params:
            code=code(
                "figures.py",
                "rotorstudy.studies.crack_study.config.load_crack_study",
                "rotorstudy.presentation.chapter_7.figures",
            ),
            load="rotorstudy.studies.crack_study.config.load_crack_study",
            function="rotorstudy.presentation.chapter_7.figures",
        log:
            f"{RESULTS}/logs/{CRACK_STUDY.name}/figures.log",
        run:
            run_script("figures.py", input, output, params, wildcards, threads, log)
