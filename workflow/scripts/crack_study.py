from rotorstudy.studies.workflow import job

with job(snakemake):
    from rotorstudy.model.rig import named_plugins
    from rotorstudy.store import provenance, save
    from rotorstudy.studies.crack_study.config import load_crack_study
    from rotorstudy.studies.workflow import named_function

    study = load_crack_study(snakemake.input.config)
    used = [plugin for rotor in study.rotors.values() for plugin in named_plugins(rotor.model_dump())]
    for stage, function in snakemake.params.functions.items():
        found = named_function(function)(study)
        origin = provenance(study.model_dump(), used, found.attrs.get("seed"))
        save(found.assign_attrs(origin), snakemake.output[stage])
