# Facts of every plugin, from the registry.
rule zoo:
    input:
        code=code("zoo.py"),
        plugins=sorted({plugin.file for _, plugin in registry()}),
    output:
        csv=f"{RESULTS}/zoo.csv",
        html=in_report(f"{RESULTS}/zoo.html", "zoo", "Zoo", "All models"),
    log:
        f"{RESULTS}/logs/zoo.log",
    script:
        "../scripts/zoo.py"
