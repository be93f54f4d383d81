"""The order of the tests: files that take longest start first, so that the workers end together."""

LONGEST = (
    "workflow/test_workflow.py",
    "foreign/test_package_against_foreign_verdicts.py",
    "diagnosis/test_measuring_chain.py",
    "blind/test_real_diagnosis.py",
    "docs/test_readme.py",
    "diagnosis/",
    "physics/test_crack_diagnosis.py",
    "measured/",
    "zoo/",
    "physics/",
    "blind/",
)


def pytest_collection_modifyitems(items):
    def rank(item):
        return next((i for i, name in enumerate(LONGEST) if f"tests/{name}" in item.nodeid), len(LONGEST))

    items.sort(key=rank)
