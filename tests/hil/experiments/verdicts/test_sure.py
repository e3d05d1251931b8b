from dataclasses import replace

import pytest

from hil.experiments.verdicts import sure
from hil.experiments.verdicts.sure import FLEETS, PLANTS, decode_sent, summarise_sure, sure_cells
from mtm_onboard.protocol import MtmError


def test_there_are_eleven_plants_beside_the_calibrated_one():
    assert len(PLANTS) == 12


@pytest.mark.parametrize("plant", ["arm", FLEETS])
def test_the_same_seed_gives_the_same_message_and_verdicts(plant):
    result = decode_sent({"plant": plant}, 3)
    assert result == decode_sent({"plant": plant}, 3)
    assert {result[f"verdict {threshold}"] for threshold in ("0.1", "0.01", "0.0001")} <= {
        "decoded", "inconclusive", "absent",
    }  # fmt: skip


def test_a_fleet_with_a_silent_robot_has_no_right_message(monkeypatch):
    monkeypatch.setattr(sure, "FAULTS", ("silent",))
    decode = sure.decode_at

    def all_decoded(*asked):
        return [replace(decoding, verdict="decoded", message=0) for decoding in decode(*asked)]

    monkeypatch.setattr(sure, "decode_at", all_decoded)
    result = decode_sent({"plant": FLEETS}, 3)
    assert result["right 0.1"] is False


def test_what_cannot_be_read_is_counted_as_refused(monkeypatch):
    def refuses(*_):
        raise MtmError("too short")

    monkeypatch.setattr(sure, "decode_at", refuses)
    (summary, *_) = summarise_sure("arm", [decode_sent({"plant": "arm"}, 3)])
    assert (summary.refused, summary.absent, summary.wrong) == (1, 0, 0)


def test_messages_are_counted_by_verdict_at_each_threshold():
    loose = {"verdict 0.1": "decoded", "right 0.1": False, "verdict 0.01": "inconclusive", "verdict 0.0001": "absent"}
    sound = {"verdict 0.1": "decoded", "right 0.1": True, "verdict 0.01": "decoded", "right 0.01": True}
    results = [{**loose, "likeliest_right": False}, {**sound, "verdict 0.0001": "absent", "likeliest_right": True}]
    at_0_1, at_0_01, at_1e_4 = summarise_sure("x", results)
    assert (at_0_1.wrong, at_0_1.right) == (1, 1)
    assert (at_0_01.wrong, at_0_01.right, at_0_01.inconclusive) == (0, 1, 1)
    assert (at_1e_4.absent, at_1e_4.likeliest_absent) == (2, 1)


def test_there_is_a_cell_for_each_message():
    assert [cell.seed for cell in sure_cells("arm", 3, 700_000)] == [700_000, 700_001, 700_002]
