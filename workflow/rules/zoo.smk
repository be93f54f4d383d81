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
    script:
        "../scripts/zoo.py"
