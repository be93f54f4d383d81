# Stages of the studies. A job does one for all rigs of a study: the start of Python takes longer than most of them.


def of_rigs(name, stage):
    return [f"{RESULTS}/{name}/{stage}/{rig}.nc" for rig in STUDIES[name].rigs]


def study_jobs(name, study):
    """Jobs of a study: the plugins each depends on, its files, and the function and arguments that compute each file."""

    def for_rigs(stage, function, *kinds):
        return kinds, of_rigs(name, stage), [(f"rotorstudy.studies.{function}", {"rig": rig}) for rig in study.rigs]

    def once(stages, *kinds):
        files = [f"{RESULTS}/{name}/{stage}.nc" for stage in stages]
        return kinds, files, [(f"rotorstudy.studies.{function}", {}) for function in stages.values()]

    def trials(rig):
        files = [f"{RESULTS}/{name}/monte_carlo/{rig}/{file_name(case)}.nc" for case in study.cases]
        calls = [("rotorstudy.studies.identify.monte_carlo", {"rig": rig, "case": case}) for case in study.cases]
        return ["estimator"], files, calls

    analyses = {stage: f"{stage}.{stage}" for stage in ("identifiability", "stability", "weight_dominance", "whirl")}
    analyses |= {"variants": "variants.variants"} if study.variants else {}
    # errors by wrong known quantities, and with fewer sensors
    sensitivity = {"bias": "identify.bias"} | ({"sensors": "sensors.sensors"} if study.sensor_sets else {})
    return {f"monte_carlo_{rig}": trials(rig) for rig in study.monte_carlo.rigs} | {
        "simulate": for_rigs("records", "simulate.simulate"),
        "spectra": for_rigs("spectra", "simulate.spectra", "spectrum"),
        "identify": for_rigs("identification", "identify.identify", "spectrum", "estimator"),
        "sensitivity": once(sensitivity, "estimator"),
        "analyses": once(analyses),
    }


for name, study in STUDIES.items():
    for stage, (kinds, files, calls) in study_jobs(name, study).items():

        rule:
            name:
                f"{stage}_{name}"
            input:
                config=str(ROOT / settings.studies[name]),
                records=of_rigs(name, "records") if stage == "spectra" else [],
                plugins=study_plugins(study, *kinds),
            output:
                files,
            params:
                code=code("study.py", *(function for function, _ in calls)),
                calls=calls,
            priority: int(stage.startswith("monte_carlo")) # the longest first
            log:
                f"{RESULTS}/logs/{name}/{stage}.log",
            script:
                "../scripts/study.py"
