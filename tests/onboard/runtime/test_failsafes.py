"""Failsafes end to end: what reaches the plant at the far end of the CAN wire when something is wrong."""

import errno
import math
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mtm_onboard.journal.journal import Journal
from mtm_onboard.model.velocity import STOP, BodyVelocity
from mtm_onboard.protocol.journal_file import JournalHeader, read_journal
from mtm_onboard.runtime.client import BaseCommandClient
from mtm_onboard.runtime.datagram_source import UdpSource
from mtm_onboard.runtime.guard import Limits, Staleness
from mtm_onboard.runtime.modulator import Modulator
from tests.onboard.driven import Driven
from tests.onboard.links.can_rig import LineRig, can_rig
from tests.onboard.schemes import small_codebook

BASE = BodyVelocity(0.3, -0.1, 0.5)
# From a tick to the plant: the next poll of the wire.
WIRE_S = 0.01
MESSAGE = Modulator(small_codebook(), "a", (2,))


def reached(rig, from_s=0.0, to_s=math.inf) -> list[BodyVelocity]:
    """What was demanded of the plant in that span."""
    return [velocity for when_s, velocity in rig.plant.commands if from_s - 1e-9 <= when_s < to_s - 1e-9]


@pytest.mark.parametrize("stale", [Staleness(), Staleness(0.3, 0.9), Staleness(0.02, 0.05)])
def test_a_silent_controller_stops_noise_first_and_then_robot(stale):
    with can_rig(LineRig) as rig, rig.transport:
        driven = Driven(rig.transport, rig.clock, MESSAGE, staleness=stale)
        driven.run(0.5, BASE)
        last_s = 0.48
        driven.run(1.5)
        noisy = reached(rig, 0.1, last_s + WIRE_S)
        ramp = reached(rig, last_s + stale.noise_off_s + 0.02 + WIRE_S, last_s + stale.stopped_s)
    assert noisy
    assert all(math.dist(velocity[:2], BASE[:2]) > 1e-4 for velocity in noisy)
    # Along the base command, ever slower.
    assert all(abs(velocity.vy_mps + velocity.vx_mps / 3.0) < 1e-6 for velocity in ramp)
    assert all(later.vx_mps < earlier.vx_mps <= 0.3 for earlier, later in pairwise(ramp))
    stopped_s = next(when_s for when_s, velocity in rig.plant.commands if when_s > 0.1 and velocity == STOP)
    assert last_s + stale.noise_off_s < stopped_s <= last_s + stale.stopped_s + 0.02 + WIRE_S
    assert set(reached(rig, stopped_s)) == {STOP}


def test_the_operator_s_stop_arrives_within_a_tick_and_stays():
    with can_rig(LineRig) as rig, rig.transport:
        driven = Driven(rig.transport, rig.clock, MESSAGE, Limits(1.0, 2.0, acceleration_mps2=0.5))
        driven.run(1.0, BASE)
        assert rig.plant.velocity_body != STOP
        driven.source.stop()
        driven.run(1.0, BASE)
        assert set(reached(rig, 1.0 + WIRE_S)) == {STOP}
        assert driven.guard.stopped


speeds = st.floats(-3.0, 3.0)
bases = st.lists(st.tuples(st.builds(BodyVelocity, speeds, speeds, speeds), st.integers(1, 5)), min_size=1, max_size=8)


@given(
    bases,
    st.floats(0.1, 2.0),
    st.floats(0.1, 2.0),
    st.floats(0.1, 6.0),
    st.one_of(st.none(), st.floats(0.5, 50.0)),
)
def test_no_command_at_the_plant_is_beyond_any_limit(commands, speed_mps, turn_radps, sigmas, acceleration_mps2):
    limits = Limits(speed_mps, turn_radps, sigmas, acceleration_mps2)
    with can_rig(LineRig) as rig, rig.transport:
        driven = Driven(rig.transport, rig.clock, MESSAGE, limits)
        for base, ticks in commands:
            driven.run(0.02 * ticks, base)
            if driven.guard.clamped == 0:
                assert math.dist(rig.plant.velocity_body[:2], base[:2]) <= math.hypot(sigmas, sigmas) * 0.1 + 1e-6
        demanded = [STOP, *reached(rig)]
    for velocity in demanded:
        assert math.hypot(*velocity[:2]) <= speed_mps + 1e-6
        assert abs(velocity.wz_radps) <= turn_radps + 1e-6
    if acceleration_mps2 is not None:
        steps_mps = [math.dist(one[:2], other[:2]) for one, other in pairwise(demanded)]
        assert max(steps_mps) <= acceleration_mps2 * 0.02 + 1e-6


@pytest.mark.parametrize(
    ("base", "limits"),
    [
        (BodyVelocity(3.0, 0.0, 0.0), Limits(0.5, 2.0)),
        (BodyVelocity(0.0, 0.0, 3.0), Limits(1.0, 0.5)),
        (BASE, Limits(1.0, 2.0, noise_sigmas=0.5)),
        (BASE, Limits(1.0, 2.0, acceleration_mps2=1.0)),
    ],
)
def test_what_is_cut_by_a_limit_is_counted(base, limits):
    with can_rig(LineRig) as rig, rig.transport:
        driven = Driven(rig.transport, rig.clock, MESSAGE, limits)
        driven.run(1.0, base)
        assert 10 <= driven.guard.clamped <= driven.stats.sent


def test_a_process_that_stalls_obeys_no_command_from_before():
    with can_rig(LineRig) as rig, rig.transport:
        source = UdpSource(0)
        client = BaseCommandClient(source.port)
        driven = Driven(rig.transport, rig.clock, MESSAGE, source=source)
        for _ in range(10):
            client.send(BASE)
            driven.run(0.02)
        assert rig.plant.velocity_body != STOP
        for _ in range(5):
            client.send(BASE)  # while the process stands still, and read only after it
        stalls = iter([3.0])

        def stall() -> bool:
            rig.clock.sleep_until(rig.clock.now() + next(stalls, 0.0))
            return False

        driven.run(3.2, stop=stall)
        assert (driven.stats.sent, driven.stats.missed) == (20, 150)
        assert set(reached(rig, 3.2 + WIRE_S)) == {STOP}
        client.send(BASE)
        driven.run(0.04)
        assert rig.plant.velocity_body != STOP
        client.close()
        source.close()


def test_a_disk_that_fills_up_costs_rows_and_no_tick(tmp_path, monkeypatch):
    header = JournalHeader(
        fingerprint="0" * 16,
        key_id="fake-key",
        robot="robot0",
        channel="a",
        symbols=(2, 0, 0, 0),
        repeat=True,
        rate_hz=50.0,
        start_s=0.0,
        start_unix_s=None,
    )

    class FullDisk:
        closed = False

        def write(self, data):
            raise OSError(errno.ENOSPC, "No space left on device")

        def fileno(self):
            raise OSError(errno.EIO, "Input/output error")

        def close(self):
            pass

    def sent(journal) -> np.ndarray:
        with can_rig(LineRig) as rig, rig.transport:
            driven = Driven(rig.transport, rig.clock, MESSAGE, journal=journal)
            driven.run(10.0, BASE)
            assert driven.stats.missed == 0
            return np.array(reached(rig))

    with Journal(tmp_path / "a.csv", header, threaded=False) as journal:
        sound = vars(journal)["_file"]
        vars(journal)["_file"] = FullDisk()
        on_a_full_disk = sent(journal)
        vars(journal)["_file"].closed = True
        sound.close()
    assert journal.lost == 500
    assert len(read_journal(journal.path).ticks) == 0
    assert np.array_equal(on_a_full_disk, sent(None))
