"""A short run of the fuzzing, and that it would find what it looks for."""

import random

import pytest

from hil.experiments.hardening import fuzz
from hil.experiments.hardening.fuzz import fuzz_cell, fuzz_cells, summarise
from hil.experiments.hardening.fuzz_targets import TARGETS, CanRobot, Target
from hil.experiments.hardening.mutations import damaged
from mtm_onboard.links import duml
from mtm_onboard.links.mavlink_codec import MavlinkCodec
from mtm_onboard.links.plaintext_messages import Splitter

INPUTS = 500


def fuzzed(target: str, seed: int = 7, inputs: int = INPUTS):
    return fuzz_cell({"target": target, "inputs": inputs}, seed)


@pytest.mark.parametrize("name", TARGETS)
def test_damaged_traffic_is_obeyed_only_where_it_reads_whole(name):
    result = fuzzed(name)
    assert (result["failure"], result["crashes"], result["unresponsive"], result["unsent"]) == ("", 0, 0, 0)
    assert result["inputs"] == INPUTS + 4  # each session ends with a filler and a sound message
    assert result["whole"] > 10
    # Among as few as these no damaged frame passes a checksum of 16 bits; text has none.
    assert (result["altered"] > 0) == name.startswith("plaintext")


def test_a_cell_is_the_same_each_time():
    kept = [{**fuzzed("can robot", inputs=100), "longest_ms": 0} for _ in range(2)]
    assert kept[0] == kept[1]
    assert kept[0] != {**fuzzed("can robot", 8, inputs=100), "longest_ms": 0}


def test_a_parser_that_checks_nothing_is_found_out(monkeypatch):
    monkeypatch.setattr(duml, "_is_sound", lambda *_: True)
    assert fuzzed("can robot", inputs=250)["unsent"] > 0  # as no bytes on the wire have the checksum that it should


def test_a_reader_that_says_what_it_read_again_is_found_out(monkeypatch):
    feed = Splitter.feed

    def twice(self, data):
        return 2 * feed(self, data)

    monkeypatch.setattr(Splitter, "feed", twice)
    assert fuzzed("plaintext robot", inputs=250)["unsent"] > 0


def test_a_crash_and_an_unresponsive_end_are_found(monkeypatch):
    decode = MavlinkCodec.decode
    monkeypatch.setattr(MavlinkCodec, "decode", lambda self, data: [] if len(data) > 60 else decode(self, data))
    assert fuzzed("mavlink vehicle", inputs=250)["crashes"] == 0
    monkeypatch.setattr(MavlinkCodec, "decode", lambda self, data: 1 / 0)
    result = fuzzed("mavlink vehicle", inputs=250)
    assert result["crashes"] == 1
    assert "ZeroDivisionError" in result["failure"]
    monkeypatch.setattr(MavlinkCodec, "decode", lambda self, data: [])
    assert fuzzed("mavlink vehicle", inputs=250)["unresponsive"] == 1


def test_the_cells_suffice_for_the_inputs_and_share_them_evenly():
    cells = fuzz_cells(100_000, 5)
    by_target = [sum(cell.parameters["target"] == name for cell in cells) for name in TARGETS]
    assert len(set(by_target)) == 1
    assert sum(int(cell.parameters["inputs"]) for cell in cells) >= 100_000
    assert min(cell.seed for cell in cells) == 5


def test_a_summary_adds_up_and_expects_altered_messages():
    one = dict.fromkeys(fuzz.COUNTS, 1) | {"failed_checks": 65_535, "longest_ms": 2.0, "failure": ""}
    other = one | {"longest_ms": 3.0, "failure": "Traceback"}
    summary = summarise("can robot", [one, other])
    assert (summary.counts["inputs"], summary.most_altered, summary.longest_ms) == (2, 2.0, 3.0)
    assert summary.failures == ("Traceback",)
    assert summarise("plaintext robot", [one]).most_altered is None
    assert summarise("mavlink vehicle, signed", [one]).most_altered < 1e-9


def test_most_inputs_are_damaged_and_some_are_sound():
    target: Target = CanRobot()
    draw = random.Random(1)
    inputs = [damaged(draw, target.traffic)[0] for _ in range(300)]
    sound = [data for data in inputs if any(data.startswith(message) for message in target.traffic.messages)]
    assert 30 < len(sound) < 200
