"""No dataclass takes more than six fields by position, since nobody can read such a call."""

import dataclasses
import inspect
import pkgutil
from importlib import import_module

import pytest

MOST = 6
# What needs a simulator or ROS to be imported holds no such class; the auditor is not yet among the packages.
PACKAGES = ("mtm_onboard", "hil")


def classes(package):
    found = set()
    for module in pkgutil.walk_packages(import_module(package).__path__, f"{package}."):
        if module.name.endswith("__main__"):
            continue
        try:
            members = vars(import_module(module.name)).values()
        except ImportError:
            continue
        found |= {kind for kind in members if inspect.isclass(kind) and kind.__module__.startswith(package)}
    return found


def positional(kind):
    return [field.name for field in dataclasses.fields(kind) if field.init and not field.kw_only]


@pytest.mark.parametrize("package", PACKAGES)
def test_a_dataclass_takes_many_fields_by_name(package):
    kinds = {kind for kind in classes(package) if dataclasses.is_dataclass(kind)}
    assert len(kinds) > 20
    assert {kind.__qualname__: positional(kind) for kind in kinds if len(positional(kind)) > MOST} == {}
