# All figures of a chapter in one job, as PNG (for the report) and SVG.

for name in CHAPTERS:

    rule:
        name:
            f"figures_{name}"
        input:
            config=chapter_config(name),
            published=PUBLISHED,
            **figure_inputs(name),
        output:
            png=captioned(name, heading(name)),
            svg=pictures(name, "svg"),
        params:
            code=code("figures.py", loader(name), f"thesis.figures.{module(name, 'replays')}.figures"),
            load=loader(name),
            function=f"thesis.figures.{module(name, 'replays')}.figures",
            reference=published_folder,
        priority: 2 * (name in REPLAYS) # the first figures, within half a minute
        log:
            f"{RESULTS}/logs/{name}/figures.log",
        run:
            run_script("figures.py", input, output, params, wildcards, threads, log)
