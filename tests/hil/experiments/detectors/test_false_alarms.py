import numpy as np
import pytest

from hil.experiments.detectors import false_alarms
from hil.experiments.detectors.false_alarms import NO_MESSAGE, WRONG_KEY, decode_nothing, false_alarm_cells, summarise


def test_cells_suffice_for_the_decodes_asked():
    cells = false_alarm_cells(WRONG_KEY, 10, "coherency", 5)
    assert [cell.seed for cell in cells] == [5, 6, 7]


def test_a_cell_that_decodes_a_whole_fleet_counts_once():
    cells = false_alarm_cells(WRONG_KEY, 10, "coherency", 31)
    assert [cell.seed for cell in cells] == [31, 32, 33, 34]


@pytest.mark.parametrize("arm", [WRONG_KEY, NO_MESSAGE])
def test_a_rollout_without_the_key_in_it_is_not_decoded(arm):
    summary = summarise(arm, [decode_nothing({"arm": arm, "detector": "coherency"}, 8)])
    assert summary.decoded == 0
    assert len(summary.p_values) == 4
    assert np.all((summary.p_values > 0.0) & (summary.p_values <= 1.0))


def test_a_fleet_in_nameless_tracks_is_decoded_and_searched(monkeypatch):
    seen = []
    decode = false_alarms.decode_tracks
    monkeypatch.setattr(false_alarms, "decode_tracks", lambda *asked: seen.append(decode(*asked)) or seen[-1])
    summary = summarise(WRONG_KEY, [decode_nothing({"arm": WRONG_KEY, "detector": "coherency"}, 32)])
    assert (len(summary.p_values), summary.decoded) == (1, 0)
    (decoding,) = seen
    assert len(decoding.channels) == 4
    assert all(channel.searched for channel in decoding.channels)


def test_the_same_seed_gives_the_same_cell():
    asked = {"arm": WRONG_KEY, "detector": "coherency"}
    assert decode_nothing(asked, 8) == decode_nothing(asked, 8)
    assert decode_nothing(asked, 8) != decode_nothing(asked, 500004)
