"""What a simulated fleet sends, read from its true motion by the time of day."""

from dataclasses import replace

import numpy as np
import pytest

from hil.fleet.lockstep import run_lockstep
from hil.fleet.recording import truth
from hil.fleet.rig import RunSettings
from hil.vehicles.shim_modulator import ShimModulator
from hil.worlds.robomaster import fleet_scheme
from mtm_onboard.protocol import Codebook, Key, MtmError
from mtm_onboard.protocol.framing import Framing, decode_frame
from mtm_onboard.protocol.slots import epoch_of_slot, slot_at
from mtm_onboard.runtime.message import message_of
from mtm_onboard.runtime.modulator import Modulator
from tests.hil.fleet.short_runs import FAKE_SECRET

MESSAGE_S = 6.0
MIDNIGHT_S = 20_000 * 86_400.0
# Four bits of payload and four of number fill the fleet's four symbols.
FRAMING = Framing("integer", 4, number_bits=4)
LAGS = range(4, 16)  # of the plant, in samples of 10 ms


def key_of(**changes) -> Key:
    return Key(
        "fake", FAKE_SECRET, replace(fleet_scheme(300), **({"framing": FRAMING, "schedule": "rolling"} | changes))
    )


def run_of(**changes) -> RunSettings:
    plain = dict(key=key_of(), symbols=None, payload=11, seconds=20.0, seed=3, wire="direct", start_s=0.5)
    return RunSettings(**(plain | changes))


class Changing(Modulator):
    """Another message is queued at tick 400, in the second message."""

    def prepare(self, tick):
        if tick == 400:
            self.queue(message_of(6, key_of(), 1))
        super().prepare(tick)


def body_velocities(trajectory) -> np.ndarray:
    """Along the robot's own axes, midway between samples: (samples - 1, 2) in m/s."""
    steps = np.diff(trajectory.positions_xy_m, axis=0) * 100.0
    heading = (trajectory.headings_rad[1:] + trajectory.headings_rad[:-1]) / 2
    cos, sin = np.cos(heading), np.sin(heading)
    return np.column_stack([cos * steps[:, 0] + sin * steps[:, 1], cos * steps[:, 1] - sin * steps[:, 0]])


def read_slot(result, key: Key, unix_s: float, slot: int):
    """The frame that the true motion spells in a slot, found by the time of day alone."""
    book = Codebook(key.secret, key.scheme, first_slot=slot)
    begin = round(100 * (slot * MESSAGE_S - unix_s))
    symbols = []
    for channel, trajectory in zip(key.scheme.channels, result.trajectories, strict=True):
        waveforms = np.repeat(book.samples(channel, 0), 2, axis=2)
        moved = body_velocities(trajectory)
        likeness = [
            np.max([np.sum(wave.T * moved[begin + lag : begin + lag + 600]) for lag in LAGS]) for wave in waveforms
        ]
        symbols.append(int(np.argmax(likeness)))
    return decode_frame(symbols, key.scheme, key.secret, epoch=epoch_of_slot(slot, key.scheme)[0])


def test_a_changed_message_begins_at_the_boundary_in_true_motion():
    settings = run_of(unix_s=MIDNIGHT_S + 600.0, seconds=25.0, modulator=Changing)
    result = run_lockstep(settings)
    first = settings.first_slot
    frames = [read_slot(result, settings.key, settings.unix_s, first + later) for later in range(3)]
    assert [(frame.payload, frame.number) for frame in frames] == [(11, 0), (11, 0), (6, 1)]
    unchanged = run_lockstep(replace(settings, modulator=Modulator))
    paths, plain = (np.stack([one.positions_xy_m for one in each.trajectories]) for each in (result, unchanged))
    differs = np.any(paths != plain, axis=(0, 2))
    boundary = round(100 * (result.onset_s + 2 * MESSAGE_S))
    assert not differs[: boundary + 7].any()
    assert differs[boundary + 8 :].all()


def test_messages_are_read_across_midnight_by_the_time_of_day():
    settings = run_of(unix_s=MIDNIGHT_S - 7.0)
    result = run_lockstep(settings)
    assert result.onset_s == 1.0
    slots = [slot_at(MIDNIGHT_S + seconds, settings.key.scheme) for seconds in (-6.0, 0.0, 6.0)]
    assert [epoch_of_slot(slot, settings.key.scheme)[0] for slot in slots] == [19_999, 20_000, 20_000]
    for slot in slots:
        assert read_slot(result, settings.key, settings.unix_s, slot).payload == 11


def test_another_start_in_a_slot_begins_with_the_same_waveforms():
    early, late = (run_of(unix_s=MIDNIGHT_S + after_s, seconds=10.0) for after_s in (0.1, 2.0))
    assert early.first_slot == late.first_slot
    assert early.unix_s + early.onset_s == pytest.approx(late.unix_s + late.onset_s, abs=1e-6)


def test_without_a_time_of_day_slot_0_begins_with_the_message():
    assert (run_of().first_slot, run_of().onset_s) == (0, 0.5)
    assert run_lockstep(run_of(seconds=1.0)).onset_s == 0.5


def test_a_fixed_schedule_does_not_ask_the_time_of_day():
    fixed = run_of(key=key_of(schedule="fixed"), seconds=2.0)
    motions = [run_lockstep(replace(fixed, unix_s=unix_s)) for unix_s in (None, MIDNIGHT_S + 3.3)]
    assert {motion.onset_s for motion in motions} == {0.5}
    paths = [np.stack([one.positions_xy_m for one in motion.trajectories]) for motion in motions]
    assert np.array_equal(*paths)


def test_the_truth_says_what_was_framed_and_when():
    settings = run_of(unix_s=MIDNIGHT_S - 7.0, seconds=2.0)
    told = truth(settings, run_lockstep(settings))
    assert (told["message"], told["onset_s"], told["unix_s"]) == (11, 1.0, MIDNIGHT_S - 7.0)
    assert told["symbols"] == message_of(11, settings.key).symbols(settings.first_slot)


def test_the_shim_refuses_a_message_whose_symbols_may_change():
    with pytest.raises(MtmError, match="Python modulator"):
        run_lockstep(run_of(seconds=2.0, modulator=ShimModulator))


@pytest.mark.parametrize(
    ("changes", "sentence"),
    [
        ({"symbols": (0, 1, 2, 3)}, "choose one"),
        ({"payload": 16}, "does not fit"),
        ({"payload": "hi"}, "numbers, not text"),
        ({"payload": None, "symbols": (0, 1, 2, 3)}, "symbols cannot be given"),
        ({"unix_s": MIDNIGHT_S, "seconds": 3.0}, "begins at 6 s; make it last longer"),
    ],
)
def test_settings_of_a_framed_run_that_make_no_sense_are_refused(changes, sentence):
    with pytest.raises(MtmError, match=sentence):
        run_of(**changes)
