from rotorstudy.studies.workflow import job

if __name__ == "__main__":  # its worker processes import this file again
    with job(snakemake):
        from pathlib import Path

        from rotorstudy.blind.config import load_blind
        from rotorstudy.blind.run import answer_chunk

        config, output = load_blind(snakemake.input.config), snakemake.output
        chunk, chunks = int(snakemake.wildcards.chunk), snakemake.params.chunks
        folder = Path(output.answers).parents[2]
        answer_chunk(config, chunk, chunks, output.seals, output.answers, folder, cores=snakemake.threads)
