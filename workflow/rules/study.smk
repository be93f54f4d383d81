# Stages of the studies. A job does one for all rigs of a study: the start of Python takes longer than most of them.


def of_rigs(name, stage):
    return [f"{RESULTS}/{name}/{stage}/{rig}.nc" for rig in STUDIES[name].rigs]


def study_jobs(name, study):
    """Jobs of a study: the plugins each depends on, results of other jobs that it needs, its files, and the function
    and arguments that compute each file."""

    def for_rigs(stage, function, *kinds, **needed):
        calls = [(f"rotorstudy.studies.{function}", {"rig": rig}) for rig in study.rigs]
        return kinds, needed, of_rigs(name, stage), calls

    def once(stages, *kinds):
        files = [f"{RESULTS}/{name}/{stage}.nc" for stage in stages]
        return kinds, {}, files, [(f"rotorstudy.studies.{function}", {}) for function in stages.values()]

    def trials(rig):
        """Monte Carlo trials of a rig: in one job, or in chunks of the noise levels and a job that gathers them."""
        chunks = min(settings.chunks.monte_carlo, len(study.monte_carlo.levels_percent))
        cases = [file_name(case) for case in study.cases]
        whole = [f"{case}.nc" for case in cases]

        def job(function, files, needed, **given):
            calls = [(f"rotorstudy.studies.identify.{function}", {"case": case, **given}) for case in cases]
            return ["estimator"], needed, [f"{RESULTS}/{name}/monte_carlo/{rig}/{file}" for file in files], calls

        if chunks == 1:
            return {f"monte_carlo_{rig}": job("monte_carlo", whole, {}, rig=rig)}
        jobs = {
            f"monte_carlo_{rig}_{i}": job(
                "monte_carlo", [f"chunks/{case}_{i}.nc" for case in cases], {}, rig=rig, chunk=i, chunks=chunks
            )
            for i in range(chunks)
        }
        parts = [path for _, _, files, _ in jobs.values() for path in files]
        return jobs | {f"monte_carlo_{rig}": job("gather_monte_carlo", whole, {"parts": parts}, chunks=chunks)}

    analyses = {stage: f"{stage}.{stage}" for stage in ("identifiability", "stability", "weight_dominance", "whirl")}
    analyses |= {"variants": "variants.variants"} if study.variants else {}
    # errors by wrong known quantities, and with fewer sensors
    sensitivity = {"bias": "identify.bias"} | ({"sensors": "sensors.sensors"} if study.sensor_sets else {})
    sampled = {stage: job for rig in study.monte_carlo.rigs for stage, job in trials(rig).items()}
    return sampled | {
        "simulate": for_rigs("records", "simulate.simulate"),
        "spectra": for_rigs("spectra", "simulate.spectra", "spectrum", records=of_rigs(name, "records")),
        "identify": for_rigs("identification", "identify.identify", "spectrum", "estimator"),
        "sensitivity": once(sensitivity, "estimator"),
        "analyses": once(analyses),
    }


for name, study in STUDIES.items():
    for stage, (kinds, needed, files, calls) in study_jobs(name, study).items():

        rule:
            name:
                f"{stage}_{name}"
            input:
                config=str(ROOT / settings.studies[name]),
                plugins=study_plugins(study, *kinds),
                **needed,
            output:
                files,
            params:
                code=code("study.py", *(function for function, _ in calls)),
                calls=calls,
            priority: int(stage.startswith("monte_carlo")) # the longest first
            log:
                f"{RESULTS}/logs/{name}/{stage}.log",
            run:
                run_script("study.py", input, output, params, wildcards, threads, log)
