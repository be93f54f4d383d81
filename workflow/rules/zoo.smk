# Facts of every plugin, from the registry.
rule zoo:
    input:
        plugins=sorted({plugin.file for _, plugin in registry()}),
    output:
        csv=f"{RESULTS}/zoo.csv",
        html=in_report(f"{RESULTS}/zoo.html", "zoo", "Plugin library", "All models"),
    params:
        code=code("zoo.py"),
    log:
        f"{RESULTS}/logs/zoo.log",
    run:
        run_script("zoo.py", input, output, params, wildcards, threads, log)


if settings.published:

    # What others printed of machines, beside ours.
    rule published:
        input:
            rigs=PRINTED,
            tables=[path.removesuffix(".yaml") + ".csv" for path in PRINTED],
            plugins=plugin_files(map(read_yaml, PRINTED)),
        output:
            csv=f"{RESULTS}/published.csv",
            html=in_report(f"{RESULTS}/published.html", "published", "Scoreboard", "All chapters"),
        params:
            code=code("published.py"),
        log:
            f"{RESULTS}/logs/published.log",
        run:
            run_script("published.py", input, output, params, wildcards, threads, log)
