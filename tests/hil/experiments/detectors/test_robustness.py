import pytest

from hil.experiments.detectors.robustness import CONDITIONS, read_under

PAPER = {"alphabet_size": 4, "ticks": 200, "windows": 1}


@pytest.mark.parametrize("condition", CONDITIONS)
def test_a_rollout_reads_well_under_every_condition(condition):
    result = read_under({"condition": condition, **PAPER}, 7)
    assert result["read"] >= 4
    assert result["right"] >= result["read"] - 1
