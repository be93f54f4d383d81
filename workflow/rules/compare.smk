# Every spectrum method with every estimator of the zoo. A new estimator runs alone on spectra that are there.
COMPARE = f"{RESULTS}/compare"
ESTIMATORS = sorted(registry().plugins["estimator"])
METHODS = sorted(registry().plugins["spectrum"])
ROTORS = {file_name(name): name for name in (COMPARISON.rotors if COMPARISON else {})}
BIASED = [name for name in STUDIES if COMPARISON and name in {c.study for c in COMPARISON.rotors.values()}]
COMPARISON_FIGURES = ["estimators", "spectra", "faults", "coverage", "bias"]


wildcard_constraints:
    rotor="|".join(ROTORS) or "none",
    method="|".join(METHODS),
    estimator="|".join(ESTIMATORS),


def compared_source(wildcards):
    """Configuration of the study or replay a rotor is of, and what the replay identified."""
    compared = COMPARISON.rotors[ROTORS[wildcards.rotor]]
    if compared.study:
        return {"source": str(ROOT / settings.studies[compared.study])}
    found = f"{RESULTS}/{compared.replay}/identification.nc"
    return {"source": str(ROOT / settings.replays[compared.replay]), "identification": found}


def method_file(kind, wildcard):
    return lambda wildcards: registry().get(kind, getattr(wildcards, wildcard)).file


def compared_plugins(wildcards):
    compared = COMPARISON.rotors[ROTORS[wildcards.rotor]]
    source = STUDIES[compared.study] if compared.study else REPLAYS[compared.replay]
    return plugin_files([source.rigs[source.main_rig] if compared.study else source.rig])


def comparison_files():
    if not COMPARISON:
        return []
    figures = [f"{COMPARE}/figures/{name}.{kind}" for name in COMPARISON_FIGURES for kind in ("png", "svg")]
    tables = [f"{COMPARE}/{name}.{kind}" for name in ("ranking", "advice") for kind in ("csv", "html")]
    return [f"{COMPARE}/comparison.nc", *figures, *tables]


if COMPARISON:

    rule compare_spectra:
        input:
            unpack(compared_source),
            config=str(ROOT / settings.compare),
            code=code("compare_spectra.py"),
            plugins=compared_plugins,
            method=method_file("spectrum", "method"),
        output:
            f"{COMPARE}/spectra/{{rotor}}/{{method}}.nc",
        params:
            rotor=lambda wildcards: ROTORS[wildcards.rotor],
        log:
            f"{RESULTS}/logs/compare/spectra_{{rotor}}_{{method}}.log",
        script:
            "../scripts/compare_spectra.py"

    rule compare_estimates:
        input:
            unpack(compared_source),
            config=str(ROOT / settings.compare),
            spectra=[f"{COMPARE}/spectra/{{rotor}}/{method}.nc" for method in METHODS],
            code=code("compare_estimates.py"),
            plugins=compared_plugins,
            estimator=method_file("estimator", "estimator"),
        output:
            f"{COMPARE}/estimates/{{rotor}}/{{estimator}}.nc",
        params:
            rotor=lambda wildcards: ROTORS[wildcards.rotor],
        log:
            f"{RESULTS}/logs/compare/estimates_{{rotor}}_{{estimator}}.log",
        script:
            "../scripts/compare_estimates.py"

    rule compare_bias:
        input:
            config=study_config,
            code=code("compare_bias.py"),
            plugins=study_plugins(),
            estimator=method_file("estimator", "estimator"),
        output:
            f"{COMPARE}/bias/{{study}}/{{estimator}}.nc",
        log:
            f"{RESULTS}/logs/compare/bias_{{study}}_{{estimator}}.log",
        script:
            "../scripts/compare_bias.py"

    rule compare:
        input:
            config=str(ROOT / settings.compare),
            spectra=[f"{COMPARE}/spectra/{rotor}/{method}.nc" for rotor in ROTORS for method in METHODS],
            estimates=[f"{COMPARE}/estimates/{rotor}/{estimator}.nc" for rotor in ROTORS for estimator in ESTIMATORS],
            bias=[f"{COMPARE}/bias/{study}/{estimator}.nc" for study in BIASED for estimator in ESTIMATORS],
            code=code("compare.py"),
        output:
            comparison=f"{COMPARE}/comparison.nc",
            tables=[f"{COMPARE}/{name}.csv" for name in ("ranking", "advice")],
            pages=[
                in_report(f"{COMPARE}/{name}.html", f"compare_{name}", "Comparison", "Tables")
                for name in ("ranking", "advice")
            ],
            png=[
                in_report(f"{COMPARE}/figures/{name}.png", f"compare_{name}", "Comparison", "Figures")
                for name in COMPARISON_FIGURES
            ],
            svg=[f"{COMPARE}/figures/{name}.svg" for name in COMPARISON_FIGURES],
        log:
            f"{RESULTS}/logs/compare/compare.log",
        script:
            "../scripts/compare.py"
