# Published spectra turned back into records, which then take the path of simulated ones.
rule replay_records:
    input:
        config=replay_config,
        published=f"{REFERENCE}/full_spectrum.csv",
        code=code("replay_records.py"),
    output:
        f"{RESULTS}/{{replay}}/records.nc",
    log:
        f"{RESULTS}/logs/{{replay}}/records.log",
    script:
        "../scripts/replay_records.py"


rule replay_spectra:
    input:
        config=replay_config,
        records=rules.replay_records.output[0],
        code=code("replay_spectra.py"),
        plugins=lambda wildcards: plugin_files([], replay_methods(wildcards)["spectrum"].values()),
    output:
        f"{RESULTS}/{{replay}}/spectra.nc",
    log:
        f"{RESULTS}/logs/{{replay}}/spectra.log",
    script:
        "../scripts/replay_spectra.py"


rule replay_identify:
    input:
        config=replay_config,
        published=f"{REFERENCE}/full_spectrum.csv",
        spectra=rules.replay_spectra.output[0],
        code=code("replay_identify.py"),
        plugins=lambda wildcards: plugin_files(
            [REPLAYS[wildcards.replay].rig], replay_methods(wildcards)["estimator"].values()
        ),
    output:
        f"{RESULTS}/{{replay}}/identification.nc",
    log:
        f"{RESULTS}/logs/{{replay}}/identification.log",
    script:
        "../scripts/replay_identify.py"
