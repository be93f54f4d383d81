"""Job of the blind tests: hide and diagnose the cases of a chunk."""

from rotorstudy.blind.config import load_blind
from rotorstudy.blind.run import answer_chunk


def answer(seals, answers, config, chunk, chunks, folder, cores=1):
    """Write the seals and answers of a chunk, 0 to chunks - 1, to two paths; folder : of the records that are kept."""
    answer_chunk(load_blind(config), int(chunk), chunks, seals, answers, folder, cores=cores)
