"""Keys and runs of the simulated fleet, for tests."""

from hil.fleet.rig import RunSettings
from hil.worlds.robomaster import fleet_scheme
from mtm_onboard.protocol import Key

FAKE_SECRET = b"not a real secret, only for test"


def fake_key(message_ticks: int = 100) -> Key:
    return Key("fake", FAKE_SECRET, fleet_scheme(message_ticks))


def short_run(**changes) -> RunSettings:
    plain = dict(key=fake_key(), symbols=(0, 1, 2, 3), seconds=3.0, seed=1, wire="direct", start_s=0.5)
    return RunSettings(**(plain | changes))
