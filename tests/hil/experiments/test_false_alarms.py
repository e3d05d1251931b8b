import numpy as np
import pytest

from hil.experiments.false_alarms import NO_MESSAGE, WRONG_KEY, decode_nothing, false_alarm_cells, summarise


def test_cells_suffice_for_the_decodes_asked():
    cells = false_alarm_cells(WRONG_KEY, 10, "coherency", 5)
    assert [cell.seed for cell in cells] == [5, 6, 7]


@pytest.mark.parametrize("arm", [WRONG_KEY, NO_MESSAGE])
def test_a_rollout_without_the_key_in_it_is_not_decoded(arm):
    summary = summarise(arm, [decode_nothing({"arm": arm, "detector": "coherency"}, 8)])
    assert summary.decoded == 0
    assert np.all((summary.p_values > 0.0) & (summary.p_values <= 1.0))
