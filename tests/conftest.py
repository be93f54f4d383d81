"""The order of the tests: files that take longest start first, so that the workers end together."""

LONGEST = (
    "workflow/test_workflow.py",
    "foreign/test_package_against_foreign.py",
    "docs/test_readme.py",
    "docs/test_adding_a_model.py",
    "diagnosis/",
    "blind/",
    "errors/test_wrong_plugins.py",
    "zoo/",
    "physics/",
)


def pytest_collection_modifyitems(items):
    def rank(item):
        return next((i for i, name in enumerate(LONGEST) if f"tests/{name}" in item.nodeid), len(LONGEST))

    items.sort(key=rank)
