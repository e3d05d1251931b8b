"""What docs/mutants.md explains is there: a mutant that no longer exists needs no excuse."""

import pytest

from tests.mutation.fates import explained_mutants
from tests.mutation.mutate import mutants_of
from tests.mutation.targets import ROOT, TARGETS

BY_MODULE = {target.module: target for target in TARGETS}
EXPLAINED = explained_mutants()


def test_only_targets_have_survivors_to_explain():
    assert EXPLAINED
    assert set(EXPLAINED) <= set(BY_MODULE)


@pytest.mark.parametrize("module", sorted(EXPLAINED))
def test_every_explained_mutant_exists(module):
    names = {mutant.name for mutant in mutants_of(BY_MODULE[module].source.read_text(encoding="utf-8"))}
    assert EXPLAINED[module]
    assert EXPLAINED[module] <= names


@pytest.mark.parametrize("target", TARGETS, ids=lambda target: target.module)
def test_the_tests_of_a_target_exist(target):
    assert target.source.exists()
    assert [test for test in target.tests if not (ROOT / test).exists()] == []
