# Records in time of every rig of a study, and their full spectra.
rule simulate:
    input:
        config=study_config,
        plugins=study_plugins(),
    output:
        f"{RESULTS}/{{study}}/records/{{rig}}.nc",
    params:
        code=code("study.py", "rotorstudy.studies.simulate.simulate"),
        function="rotorstudy.studies.simulate.simulate",
        rig="{rig}",
    log:
        f"{RESULTS}/logs/{{study}}/simulate_{{rig}}.log",
    script:
        "../scripts/study.py"


rule spectra:
    input:
        config=study_config,
        records=rules.simulate.output[0],
        plugins=study_plugins("spectrum"),
    output:
        f"{RESULTS}/{{study}}/spectra/{{rig}}.nc",
    params:
        code=code("study.py", "rotorstudy.studies.simulate.spectra"),
        function="rotorstudy.studies.simulate.spectra",
    log:
        f"{RESULTS}/logs/{{study}}/spectra_{{rig}}.log",
    script:
        "../scripts/study.py"
