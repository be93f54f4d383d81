"""Hide effects in simulated measurements and diagnose them."""

from rotorstudy.commands.shared import check_folder, file_of_project

CONFIG = file_of_project("blind/blind.yaml", "workflow/config/blind.yaml")
FEW = 20  # cases, with which most criteria cannot be judged: they are not listed


def add(parser):
    parser.add_argument("--config", default=CONFIG, help="configuration of the cases (default: the project's own)")
    parser.add_argument("--cases", type=int, metavar="N", help="number of cases (default: the configuration's)")
    parser.add_argument("--seed", type=int, metavar="S", help="random seed (default: the configuration's)")
    parser.add_argument("--cores", type=int, default=1, metavar="K", help="number of processes (default 1)")
    parser.add_argument("--out", required=True, help="output folder")


def run(given):
    """Run the blind tests and write their pages."""
    from rotorstudy.blind.config import load_blind
    from rotorstudy.blind.criteria import printed, sentences, statement
    from rotorstudy.blind.run import run_blind
    from rotorstudy.presentation.blind_page import write_pages

    check_folder(given.out)
    config = load_blind(given.config)
    data, criteria, rows = run_blind(config, given.out, cases=given.cases, seed=given.seed, cores=given.cores)
    write_pages(data, criteria, rows, given.out)
    print("\n".join(sentences(criteria)) or f"{len(rows)} cases, of which none answers a question")
    print(statement(criteria) if len(rows) < FEW else printed(criteria))
    print(f"wrote {given.out}/criteria.html, cases.html, blind.nc and figures")
    return {"cases": len(rows), "criteria": criteria.to_dict("records"), "page": f"{given.out}/criteria.html"}
