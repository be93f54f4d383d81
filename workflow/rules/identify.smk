# Identification of every case without noise and under noise (Monte Carlo), and the stages of a study with one file each.
rule identify:
    input:
        config=study_config,
        code=code("study.py", "rotorstudy.studies.identify.identify"),
        plugins=study_plugins("spectrum", "estimator"),
    output:
        f"{RESULTS}/{{study}}/identification/{{rig}}.nc",
    params:
        function="rotorstudy.studies.identify.identify",
        rig="{rig}",
    log:
        f"{RESULTS}/logs/{{study}}/identify_{{rig}}.log",
    script:
        "../scripts/study.py"


rule monte_carlo:
    input:
        config=study_config,
        code=code("study.py", "rotorstudy.studies.identify.monte_carlo"),
        plugins=study_plugins("estimator"),
    output:
        f"{RESULTS}/{{study}}/monte_carlo/{{rig}}/{{case}}.nc",
    params:
        function="rotorstudy.studies.identify.monte_carlo",
        rig="{rig}",
        case="{case}",
    log:
        f"{RESULTS}/logs/{{study}}/monte_carlo_{{rig}}_{{case}}.log",
    script:
        "../scripts/study.py"


for stage, (function, kinds) in STUDY_STAGES.items():

    rule:
        name:
            stage
        input:
            config=study_config,
            code=code("study.py", function),
            plugins=study_plugins(*kinds),
        output:
            f"{RESULTS}/{{study}}/{stage}.nc",
        params:
            function=function,
        log:
            f"{RESULTS}/logs/{{study}}/{stage}.log",
        script:
            "../scripts/study.py"
