"""The order of the tests: the workflow as a whole takes longest, so it starts first."""


def pytest_collection_modifyitems(items):
    items.sort(key=lambda item: "tests/workflow/" not in item.nodeid)
