from rotorstudy.studies.workflow import job

if __name__ == "__main__":  # its worker processes import this file again
    with job(snakemake):
        from pathlib import Path

        from rotorstudy.blind.config import load_blind
        from rotorstudy.blind.criteria import printed
        from rotorstudy.blind.run import run_blind
        from rotorstudy.presentation.blind_page import write_pages

        folder = Path(snakemake.output.data).parent
        data, criteria, rows = run_blind(load_blind(snakemake.input.config), folder, cores=snakemake.threads)
        write_pages(data, criteria, rows, folder, *snakemake.input.independent)
        print(printed(criteria))
