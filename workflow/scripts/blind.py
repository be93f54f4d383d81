from rotorstudy.studies.workflow import index_page, job

with job(snakemake):
    from pathlib import Path

    from rotorstudy.blind.config import load_blind
    from rotorstudy.blind.criteria import printed
    from rotorstudy.blind.run import gather_chunks
    from rotorstudy.presentation.blind_page import write_pages

    given, folder = snakemake.input, Path(snakemake.output.data).parent
    data, criteria, rows = gather_chunks(load_blind(given.config), folder, given.seals, given.answers)
    write_pages(data, criteria, rows, folder, *given.independent, index=index_page(snakemake))
    print(printed(criteria))
