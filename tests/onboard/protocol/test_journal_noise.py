"""Journals that leave the noise out: nobody plays it from them, and the key makes it again."""

from dataclasses import replace

import numpy as np
import pytest

from mtm_onboard.journal.journal import Journal
from mtm_onboard.links.none import NullLink
from mtm_onboard.model.velocity import BodyVelocity
from mtm_onboard.protocol import Key, MtmError
from mtm_onboard.protocol.framing import Framing
from mtm_onboard.protocol.journal_file import JournalHeader, read_journal
from mtm_onboard.protocol.journal_noise import with_noise
from mtm_onboard.runtime.guard import CLAMPED, NOISE, Guard, Limits, Staleness
from mtm_onboard.runtime.message import message_of
from mtm_onboard.runtime.modulator import Modulator
from mtm_onboard.runtime.source import HeldSource
from mtm_onboard.runtime.tick import Runtime
from tests.onboard.schemes import FAKE_SECRET, small_scheme

FRAMED = Framing("integer", 4, number_bits=2, interleave=True)
BASE = BodyVelocity(0.2, -0.1, 0.3)
SLOT = 700_000_000


class Heard(NullLink):
    def __init__(self) -> None:
        super().__init__()
        self.velocities: list[BodyVelocity] = []

    def send(self, velocity: BodyVelocity) -> None:
        super().send(velocity)
        self.velocities.append(velocity)


def run(path, schedule, ticks=range(-20, 700), max_bytes=10_000_000, speed_mps=3.0):
    """A run on channel "b", three windows a message, whose message changes at tick 480; and what the link heard."""
    key = Key("fake-key", FAKE_SECRET, small_scheme(schedule=schedule, framing=FRAMED))
    slot = SLOT if schedule == "rolling" else 0
    message = message_of(9, key)
    modulator = Modulator(key.codebook(slot), "b", message)
    header = JournalHeader(
        fingerprint=key.scheme.fingerprint, key_id=key.id, robot="r", channel="b", symbols=message.symbols(slot),
        repeat=True, rate_hz=50.0, start_s=0.0, start_unix_s=None,
    )  # fmt: skip
    link, source = Heard(), HeldSource()
    guard = Guard(Limits(speed_mps, 0.4 if speed_mps < 1.0 else 3.0), Staleness(), noise_sigma=0.2, period_s=0.02)
    with Journal(path, header, threaded=False, hides_noise=True, max_bytes=max_bytes) as journal:
        runtime = Runtime(modulator, guard, source, link, journal)
        for tick in ticks:
            if tick == 400:
                modulator.queue(message_of(3, key, 1))
            source.set(BASE, tick / 50.0)
            runtime.step(tick, tick / 50.0)
    return key, link.velocities, read_journal(path)


@pytest.mark.parametrize("schedule", ["fixed", "rolling"])
def test_a_journal_holds_no_waveform_and_the_key_makes_it_again(tmp_path, schedule):
    key, heard, record = run(tmp_path / "r.csv", schedule)
    noisy = (record.flags & NOISE) > 0
    assert np.count_nonzero(noisy) > 690
    assert np.isnan(record.sent[noisy]).all()
    assert record.sent[~noisy] == pytest.approx(record.base[~noisy])
    again = with_noise(record, key)
    assert again.sent == pytest.approx(np.array(heard), abs=1e-6)
    assert (record.damaged, len(record.slots)) == (0, 6)


def test_ticks_that_never_came_shift_no_noise(tmp_path):
    ticks = [tick for tick in range(700) if not 100 <= tick < 130 and tick % 7]
    key, heard, record = run(tmp_path / "r.csv", "rolling", ticks)
    assert with_noise(record, key).sent == pytest.approx(np.array(heard), abs=1e-6)


def test_each_segment_says_what_its_rows_play(tmp_path):
    key, heard, record = run(tmp_path / "r.csv", "rolling", range(6000), max_bytes=80_000)
    kept = len(record.ticks)
    assert kept < 5000
    assert with_noise(record, key).sent == pytest.approx(np.array(heard[-kept:]), abs=1e-6)


def test_noise_that_a_limit_cut_is_not_made_up(tmp_path):
    key, _, record = run(tmp_path / "r.csv", "rolling", speed_mps=0.5)
    cut = (record.flags & CLAMPED) > 0
    assert np.count_nonzero(cut) > 10
    assert np.isnan(with_noise(record, key).sent[cut & (record.flags & NOISE > 0)]).all()


def test_another_key_makes_nothing_again(tmp_path):
    key, _, record = run(tmp_path / "r.csv", "rolling")
    with pytest.raises(MtmError, match="the journal is of key fake-key"):
        with_noise(record, replace(key, id="other"))
    with pytest.raises(MtmError, match="the journal is of key fake-key"):
        with_noise(record, replace(key, scheme=replace(key.scheme, name="other")))
