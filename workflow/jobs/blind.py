"""Job of the blind tests: open the truth, score the answers, write the pages."""

from rotorstudy.blind.criteria import printed
from rotorstudy.blind.run import gather_chunks
from rotorstudy.presentation.blind_page import write_pages


def gather(config, seals, answers, independent, sources, folder, index):
    """Write results and pages of the seals and answers of all chunks, beside other runs (files and their names)."""
    data, criteria, rows = gather_chunks(config, folder, seals, answers)
    write_pages(data, criteria, rows, folder, dict(zip(sources, independent, strict=True)), index=index)
    print(printed(criteria))
