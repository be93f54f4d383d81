# Identification of every case without noise and under noise (Monte Carlo), and the stages of a study with one file each.
rule identify:
    input:
        config=study_config,
        plugins=study_plugins("spectrum", "estimator"),
    output:
        f"{RESULTS}/{{study}}/identification/{{rig}}.nc",
    params:
        code=code("study.py", "rotorstudy.studies.identify.identify"),
        function="rotorstudy.studies.identify.identify",
        rig="{rig}",
    log:
        f"{RESULTS}/logs/{{study}}/identify_{{rig}}.log",
    script:
        "../scripts/study.py"


rule monte_carlo:
    input:
        config=study_config,
        plugins=study_plugins("estimator"),
    output:
        f"{RESULTS}/{{study}}/monte_carlo/{{rig}}/{{case}}.nc",
    params:
        code=code("study.py", "rotorstudy.studies.identify.monte_carlo"),
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
            plugins=study_plugins(*kinds),
        output:
            f"{RESULTS}/{{study}}/{stage}.nc",
        params:
            code=code("study.py", function),
            function=function,
        log:
            f"{RESULTS}/logs/{{study}}/{stage}.log",
        script:
            "../scripts/study.py"
