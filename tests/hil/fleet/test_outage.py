"""A lost link from the robot to the verdict: the message goes on by tick numbers, so what was sent decodes."""

import numpy as np
import pytest

from mtm_audit.decoding.decode import decode_tracks
from mtm_audit.decoding.settings import DecodeSettings
from mtm_audit.reporting.journal_summary import injected_noise, summary_of
from mtm_onboard.journal.journal import Journal
from mtm_onboard.links.reconnecting import ReconnectingLink
from mtm_onboard.model.velocity import STOP, BodyVelocity
from mtm_onboard.protocol.journal_file import JournalHeader, read_journal
from mtm_onboard.runtime.modulator import Modulator
from tests.audit.moving_robot import key_of, observed, scheme_of
from tests.onboard.driven import Driven
from tests.onboard.links.can_rig import LineRig, can_rig

KEY = key_of(scheme_of(symbols=(2,), ticks=400))
SYMBOLS = (3, 1)
BASE = BodyVelocity(0.2, 0.05, 0.0)


@pytest.fixture(scope="module")
def outage(tmp_path_factory):
    """24 s of an 8 s message through an outage of 3 s: the motion that a camera saw, and the journal."""
    path = tmp_path_factory.mktemp("outage") / "robot0.csv"
    header = JournalHeader(
        fingerprint=KEY.scheme.fingerprint,
        key_id=KEY.id,
        robot="robot0",
        channel="robot0",
        symbols=SYMBOLS,
        repeat=True,
        rate_hz=50.0,
        start_s=0.0,
        start_unix_s=None,
    )
    poses = []
    with can_rig(LineRig, deadman_s=0.2) as rig, Journal(path, header, threaded=False) as journal:
        link = ReconnectingLink(rig.remake, rig.clock)
        rig.clock.every(link.service_period_s, link.service)
        rig.clock.every(0.01, lambda _: poses.append(rig.plant.position_xy_m))
        with link:
            driven = Driven(link, rig.clock, Modulator(KEY.codebook(), "robot0", SYMBOLS), journal=journal)
            driven.run(9.0, BASE)
            rig.cut()
            driven.run(0.5, BASE)
            assert rig.plant.velocity_body == STOP
            driven.run(2.5, BASE)
            rig.mend()
            driven.run(12.0, BASE)
        assert link.losses == 1
    motion = np.array(poses)
    return observed("robot0", np.arange(len(motion)) * 0.01, motion, 100.0, seed=1), read_journal(path)


def test_the_windows_that_were_sent_still_decode(outage):
    track, _ = outage
    decoding = decode_tracks((track,), KEY, DecodeSettings(detector="coherency", onset_s=0.0, decoys=30))
    assert (decoding.verdict, decoding.symbols) == ("decoded", SYMBOLS)


def test_the_journal_holds_what_was_in_the_motion(outage):
    track, record = outage
    truth = injected_noise(record)
    seen = np.stack([np.interp(truth.edges_s, track.times_s, column) for column in track.positions.T], axis=1)
    velocities = np.diff(seen, axis=0) * 50.0
    base = np.where(truth.velocities[:, :2].any(axis=1)[:, None], BASE[:2], 0.0)
    # The wire takes a poll, half a tick.
    for axis in range(2):
        moved = velocities[:, axis] - base[:, axis]
        assert np.corrcoef(moved, truth.velocities[:, axis])[0, 1] > 0.75
    summary = summary_of(record)
    lost, back = summary.events
    assert (lost.tick, "bus off" in lost.text, back.text) == (451, True, "the link is back")
    # Mended after 3 s, it is found by the next trial, 3.1 s after the loss.
    assert back.tick * 0.02 == pytest.approx(12.1, abs=0.05)
    assert summary.counts["held"] == back.tick - lost.tick + 1
