from rotorstudy.studies.workflow import job

with job(snakemake):
    from rotorstudy.store import save
    from rotorstudy.studies.cracks import compare, load_cracks

    save(compare(load_cracks(snakemake.input.config)), snakemake.output[0])
