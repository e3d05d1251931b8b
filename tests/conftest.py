import os
import random
import secrets

import pytest
from hypothesis import Phase, settings

# Many small matrix products lose more to threads than they gain, twentyfold when the machine is busy.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

# The same examples in every run: `make test` says whether the program changed and not which seed was drawn. Shared
# machines are slow at odd moments, so examples are bounded in number and not in time.
settings.register_profile("plain", deadline=None, max_examples=50, derandomize=True, database=None)
# `make explore` looks for what the fixed examples miss.
settings.register_profile("explore", deadline=None, max_examples=500, database=None, print_blob=True)
# `make mutants` asks only whether some example fails, and asks it thousands of times.
settings.register_profile("mutants", settings.get_profile("plain"), phases=[Phase.explicit, Phase.generate])
settings.load_profile(os.environ.get("MTM_HYPOTHESIS", "plain"))

# Keys drawn in this process are the same in every run as well: now and then one has a rare property, such as a sample
# that the guard cuts, and a test that stumbles over it must do so each time.
_DRAWN = random.Random()


def _token_bytes(count: int | None = None) -> bytes:
    return _DRAWN.randbytes(32 if count is None else count)


def pytest_configure():
    secrets.token_bytes = _token_bytes


@pytest.hookimpl(tryfirst=True)
def pytest_runtest_setup(item):
    _DRAWN.seed(item.nodeid)


# How the reasons of those skips begin that no installation would end.
BY_DESIGN = (
    "this rig has no ", "this system grants no ", "compares times;", "takes times of the wall clock;",
    "only when asked for;",
)  # fmt: skip


def pytest_addoption(parser):
    parser.addoption("--nothing-missing", action="store_true", help="what is skipped for a missing tool fails")


def _refused(report, config):
    """The report, as a failure where it tells of something that was skipped because it is not installed."""
    if config.getoption("--nothing-missing") and report.skipped and isinstance(report.longrepr, tuple):
        reason = report.longrepr[2].removeprefix("Skipped: ")
        if not reason.startswith(BY_DESIGN):
            report.outcome = "failed"
            report.longrepr = f"skipped where nothing may be missing: {reason}"
    return report


@pytest.hookimpl(wrapper=True)
def pytest_runtest_makereport(item):
    return _refused((yield), item.config)


@pytest.hookimpl(wrapper=True)
def pytest_make_collect_report(collector):
    return _refused((yield), collector.config)
