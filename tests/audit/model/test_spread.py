import pytest

from mtm_audit.model.spread import spread_evenly


@pytest.mark.parametrize(
    ("count", "most", "chosen"), [(0, 12, ()), (3, 12, (0, 1, 2)), (100, 4, (12, 37, 62, 87)), (1, 1, (0,))]
)
def test_numbers_are_spread_evenly(count, most, chosen):
    assert spread_evenly(count, most) == chosen
