import json
import math

import numpy as np
import pytest

from hil.fleet.clock import SimulatedClock
from mtm_audit.cli import main
from mtm_audit.reporting.journal_summary import injected_noise, summary_of
from mtm_onboard.journal.journal import Journal
from mtm_onboard.links.none import NullLink
from mtm_onboard.model.velocity import STOP, BodyVelocity
from mtm_onboard.protocol import MtmError
from mtm_onboard.protocol.journal_file import CLAMPED, NOISE, UNSENT, JournalHeader, read_journal
from mtm_onboard.runtime.guard import Limits
from mtm_onboard.runtime.modulator import Modulator
from tests.onboard.driven import Driven
from tests.onboard.schemes import FAKE_SECRET, small_codebook

BASE = BodyVelocity(0.3, -0.1, 0.5)
MESSAGE = Modulator(small_codebook(), "a", (2,))
HEADER = JournalHeader(
    fingerprint="0123456789abcdef",
    key_id="fake-key",
    robot="robot0",
    channel="a",
    symbols=(2, 0, 1, 3),
    repeat=True,
    rate_hz=50.0,
    start_s=0.0,
    start_unix_s=1.7e9,
)


@pytest.fixture
def run(tmp_path):
    """Six seconds of a message, and then a second of stale commands."""
    clock = SimulatedClock()
    with Journal(tmp_path / "run.csv", HEADER, threaded=False) as journal:
        driven = Driven(NullLink(), clock, MESSAGE, Limits(1.0, 2.0, noise_sigmas=2.0), journal=journal)
        driven.run(6.0, BASE)
        driven.run(1.0)
        driven.source.stop()
        driven.run(0.1, BASE)
    assert driven.guard.clamped > 0
    return journal.path, driven.guard


def test_a_run_in_numbers(run):
    path, guard = run
    summary = summary_of(read_journal(path))
    assert (summary.ticks, summary.first_tick, summary.last_tick, summary.missed) == (355, 0, 354, 0)
    assert summary.counts == {
        "with noise": 304, "clamped": guard.clamped, "stale": guard.stale, "refused": 0, "stopped": 5, "held": 0,
        "unsent": 0,
    }  # fmt: skip
    assert summary.saturation == guard.clamped / 355
    assert summary.lateness_s == pytest.approx((0.0, 0.0, 0.0), abs=1e-6)
    # Sigma is 0.1 m/s on both axes, bounded at twice that; nothing is added to the turn rate.
    assert summary.rms[:2] == pytest.approx((0.1, 0.1), abs=0.02)
    assert summary.energy[0] == pytest.approx(summary.rms[0] ** 2 * 304 / 50.0)
    assert summary.rms[2] == summary.energy[2] == 0.0


def test_a_journal_s_noise_is_the_modulator_s_within_limits(run):
    path, _ = run
    record = read_journal(path)
    truth = injected_noise(record, start_s=3.0)
    assert (truth.name, truth.axes) == ("robot0", ("vx", "vy", "wz"))
    assert truth.edges_s == pytest.approx(3.0 + np.arange(356) / 50.0)
    whole = record.flags == NOISE
    assert np.count_nonzero(whole) > 200
    expected = 0.1 * np.array([MESSAGE.perturbation(tick) for tick in range(355)])
    assert truth.velocities[whole, :2] == pytest.approx(expected[whole], abs=1e-8)
    assert not truth.velocities[304:].any()
    assert truth.valid.all()


def test_in_a_missing_tick_the_noise_is_held_and_not_valid(tmp_path):
    with Journal(tmp_path / "a.csv", HEADER, threaded=False) as journal:
        for tick in (-2, -1, 0, 3, 4):
            sent = BodyVelocity(0.1 * tick, 0.0, 0.0)
            journal.append(tick, tick / 50.0, STOP, sent, UNSENT if tick == -1 else NOISE, 0.0)
    record = read_journal(journal.path)
    truth = injected_noise(record)
    assert truth.edges_s == pytest.approx(1.7e9 + np.arange(-2, 6) / 50.0, abs=1e-6)
    assert truth.velocities[:, 0] == pytest.approx([-0.2, 0.0, 0.0, 0.0, 0.0, 0.3, 0.4])
    assert truth.valid.tolist() == [True, True, True, False, False, True, True]
    assert summary_of(record).missed == 2
    assert summary_of(record).as_table()["ticks"] | {"sent": 4, "unsent": 1} == summary_of(record).as_table()["ticks"]


def test_simulated_noise_counts_from_the_message_s_start(tmp_path):
    header = JournalHeader(
        fingerprint="0" * 16,
        key_id="fake-key",
        robot="robot0",
        channel="a",
        symbols=None,
        repeat=True,
        rate_hz=50.0,
        start_s=100.0,
        start_unix_s=None,
    )
    with Journal(tmp_path / "a.csv", header, threaded=False) as journal:
        journal.append(0, 100.0, BASE, BASE, CLAMPED, 0.0)
    assert injected_noise(read_journal(journal.path)).edges_s == pytest.approx([0.0, 0.02])


@pytest.mark.parametrize(("ticks", "sentence"), [((), "has no ticks"), ((3, 1), "run backwards")])
def test_what_is_no_run_is_refused(tmp_path, ticks, sentence):
    with Journal(tmp_path / "a.csv", HEADER, threaded=False) as journal:
        for tick in ticks:
            journal.append(tick, HEADER.start_s + tick / HEADER.rate_hz, BASE, BASE, 0, 0.0)
    record = read_journal(journal.path)
    for ask in (summary_of, injected_noise):
        with pytest.raises(MtmError, match=sentence):
            ask(record)


def audit(*arguments) -> int:
    with pytest.raises(SystemExit) as left:
        main(["journal", *map(str, arguments)])
    return left.value.code or 0


def test_the_command_prints_what_a_person_asks_first(run, capsys):
    assert audit(run[0]) == 0
    shown = capsys.readouterr().out
    for fact in (
        "robot0", "fake-key", "0123456789abcdef", "symbols 2,0,1,3, repeated", "1700000000.000000 s (Unix time)",
        "2023-11-14 22:13:20 UTC", "355 at 50 Hz", "0 missed", "304 with noise", "5 stopped", "the operator said stop",
    ):  # fmt: skip
        assert fact in shown, fact
    assert FAKE_SECRET.hex() not in shown


def test_json_says_the_same_for_programs(run, capsys):
    assert audit(run[0], "--json") == 0
    told = json.loads(capsys.readouterr().out)
    assert told["message"] == {"symbols": [2, 0, 1, 3], "repeat": True, "start_unix_s": 1.7e9, "rate_hz": 50.0}
    assert (told["ticks"]["sent"], told["ticks"]["with_noise"], told["ticks"]["missed"]) == (355, 304, 0)
    assert told["events"] == [{"tick": 350, "text": "the operator said stop"}]
    assert all(math.isfinite(axis["energy"]) for axis in told["noise"].values())


def test_a_picture_s_wrong_name_is_refused_before_the_reading(run, tmp_path, capsys):
    assert audit(run[0], "--plot", tmp_path / "run.png") == 0
    assert (tmp_path / "run.png").read_bytes().startswith(b"\x89PNG\r\n")
    assert audit(tmp_path / "none.csv", "--plot", tmp_path / "run.txt") == 2
    assert "no picture format" in capsys.readouterr().err


def test_what_is_no_journal_is_one_sentence(tmp_path, capsys):
    (tmp_path / "a.csv").write_text("1,2,3\n")
    assert audit(tmp_path / "a.csv") == 1
    assert audit(tmp_path / "none.csv") == 1
    error = capsys.readouterr().err
    assert "does not begin like a journal" in error
    assert "check the name" in error
    assert error.count("\n") == 2
