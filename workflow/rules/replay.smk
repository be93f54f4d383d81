# Published spectra converted to records, which are then processed like simulated ones.
rule replay_records:
    input:
        config=replay_config,
        published=PUBLISHED,
    output:
        f"{RESULTS}/{{replay}}/records.nc",
    params:
        code=code("replay.py", "thesis.replay.records"),
        function="thesis.replay.records",
        reference=published_folder,
    priority: 2 # short, and what the first figures need
    log:
        f"{RESULTS}/logs/{{replay}}/records.log",
    run:
        run_script("replay.py", input, output, params, wildcards, threads, log)


rule replay_spectra:
    input:
        config=replay_config,
        records=rules.replay_records.output[0],
        plugins=lambda wildcards: plugin_files([], replay_methods(wildcards)["spectrum"].values()),
    output:
        f"{RESULTS}/{{replay}}/spectra.nc",
    params:
        code=code("replay.py", "thesis.replay.spectra"),
        function="thesis.replay.spectra",
    priority: 2
    log:
        f"{RESULTS}/logs/{{replay}}/spectra.log",
    run:
        run_script("replay.py", input, output, params, wildcards, threads, log)


rule replay_identify:
    input:
        config=replay_config,
        published=PUBLISHED,
        spectra=rules.replay_spectra.output[0],
        plugins=lambda wildcards: plugin_files(
            [REPLAYS[wildcards.replay].rig], replay_methods(wildcards)["estimator"].values()
        ),
    output:
        f"{RESULTS}/{{replay}}/identification.nc",
    params:
        code=code("replay.py", "thesis.replay.identify"),
        function="thesis.replay.identify",
        reference=published_folder,
    priority: 2
    log:
        f"{RESULTS}/logs/{{replay}}/identification.log",
    run:
        run_script("replay.py", input, output, params, wildcards, threads, log)
