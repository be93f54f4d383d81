# Identification of every case: without noise, under noise (Monte Carlo), and with wrong known quantities.
rule identify:
    input:
        config=study_config,
        code=code("identify.py"),
        plugins=study_plugins("spectrum", "estimator"),
    output:
        f"{RESULTS}/{{study}}/identification/{{rig}}.nc",
    log:
        f"{RESULTS}/logs/{{study}}/identify_{{rig}}.log",
    script:
        "../scripts/identify.py"


rule monte_carlo:
    input:
        config=study_config,
        code=code("monte_carlo.py"),
        plugins=study_plugins("estimator"),
    output:
        f"{RESULTS}/{{study}}/monte_carlo/{{rig}}/{{case}}.nc",
    log:
        f"{RESULTS}/logs/{{study}}/monte_carlo_{{rig}}_{{case}}.log",
    script:
        "../scripts/monte_carlo.py"


rule bias:
    input:
        config=study_config,
        code=code("bias.py"),
        plugins=study_plugins("estimator"),
    output:
        f"{RESULTS}/{{study}}/bias.nc",
    log:
        f"{RESULTS}/logs/{{study}}/bias.log",
    script:
        "../scripts/bias.py"


rule identifiability:
    input:
        config=study_config,
        code=code("identifiability.py"),
        plugins=study_plugins(),
    output:
        f"{RESULTS}/{{study}}/identifiability.nc",
    log:
        f"{RESULTS}/logs/{{study}}/identifiability.log",
    script:
        "../scripts/identifiability.py"


rule sensors:
    input:
        config=study_config,
        code=code("sensors.py"),
        plugins=study_plugins("estimator"),
    output:
        f"{RESULTS}/{{study}}/sensors.nc",
    log:
        f"{RESULTS}/logs/{{study}}/sensors.log",
    script:
        "../scripts/sensors.py"


rule variants:
    input:
        config=study_config,
        code=code("variants.py"),
        plugins=study_plugins(),
    output:
        f"{RESULTS}/{{study}}/variants.nc",
    log:
        f"{RESULTS}/logs/{{study}}/variants.log",
    script:
        "../scripts/variants.py"
