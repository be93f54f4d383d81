# Records in time of every rig of a study, and their full spectra.
rule simulate:
    input:
        config=study_config,
        code=code("simulate.py"),
        plugins=study_plugins(),
    output:
        f"{RESULTS}/{{study}}/records/{{rig}}.nc",
    log:
        f"{RESULTS}/logs/{{study}}/simulate_{{rig}}.log",
    script:
        "../scripts/simulate.py"


rule spectra:
    input:
        config=study_config,
        records=rules.simulate.output[0],
        code=code("spectra.py"),
        plugins=study_plugins("spectrum"),
    output:
        f"{RESULTS}/{{study}}/spectra/{{rig}}.nc",
    log:
        f"{RESULTS}/logs/{{study}}/spectra_{{rig}}.log",
    script:
        "../scripts/spectra.py"


rule weight_dominance:
    input:
        config=study_config,
        code=code("weight_dominance.py"),
        plugins=study_plugins(),
    output:
        f"{RESULTS}/{{study}}/weight_dominance.nc",
    log:
        f"{RESULTS}/logs/{{study}}/weight_dominance.log",
    script:
        "../scripts/weight_dominance.py"


rule stability:
    input:
        config=study_config,
        code=code("stability.py"),
        plugins=study_plugins(),
    output:
        f"{RESULTS}/{{study}}/stability.nc",
    log:
        f"{RESULTS}/logs/{{study}}/stability.log",
    script:
        "../scripts/stability.py"


rule whirl:
    input:
        config=study_config,
        code=code("whirl.py"),
        plugins=study_plugins(),
    output:
        f"{RESULTS}/{{study}}/whirl.nc",
    log:
        f"{RESULTS}/logs/{{study}}/whirl.log",
    script:
        "../scripts/whirl.py"
