VMAS = ("test_discovery.py", "test_football.py")


def pytest_ignore_collect(collection_path, config):
    """Leaves the modules that cannot be imported without VMAS to those who ask for more than `make test` does."""
    return True if collection_path.name in VMAS and config.getoption("markexpr") == "not long" else None
