"""A disclosed day's key, carried by the motion of a later day's robots and read by who has the anchor alone.

One cell is one rollout of the four robots of the key generator's preset, each of which drives to goals drawn at random
for as long as it is filmed, and of a fleet's chain of its own. The auditor knows the time to half a minute. The key is
recovered when what the public channel carries is the day's key that the anchor confirms.
"""

from dataclasses import dataclass
from datetime import UTC, date, datetime, timedelta

import numpy as np

from hil.experiments.runs.cells import Scalar, Values
from hil.fleet.lockstep import run_lockstep
from hil.fleet.recording import motion_capture_tracks
from hil.fleet.rig import RunSettings
from hil.sensors.motion_capture import MotionCapture
from hil.worlds.robomaster import tagged_scheme
from hil.worlds.tasks import random_task
from mtm_audit.decoding.decode import decode_tracks
from mtm_audit.decoding.settings import DecodeSettings
from mtm_audit.model.recorded_at import RecordedAt
from mtm_onboard.protocol import Key, MtmError
from mtm_onboard.protocol.disclosure import anchor_of, disclosed_key
from mtm_onboard.protocol.holding import Grant, epoch_of_day
from mtm_onboard.protocol.key_tree import tree_of
from mtm_onboard.protocol.keystream import SECRET_BYTES
from mtm_onboard.protocol.master import MasterHolding
from mtm_onboard.protocol.public_channel import carried_key, link_to_carry, public_key, public_scheme

_STREAM = 61
_DAY = date(2026, 1, 31)
_LEAD_S, _TAIL_S = 1.5, 0.5
_CLOCK_ERROR_S = 30.0


@dataclass(frozen=True)
class Sight:
    """What is filmed: `robots` of the four, for a part of one message from its beginning on."""

    name: str
    robots: int
    part: float


SIGHTS = {
    sight.name: sight
    for sight in (
        Sight("four robots, one message", 4, 1.0),
        Sight("three of four robots, one message", 3, 1.0),
        Sight("four robots, three quarters of a message", 4, 0.75),
    )
}


def seconds_of(sight: Sight) -> float:
    """How much of the message's motion is filmed."""
    scheme = public_scheme(tagged_scheme())
    return sight.part * scheme.message_ticks / scheme.rate_hz


def key_bps(sight: Sight) -> float:
    """Bits of the day's key for each second that is filmed."""
    return 8 * SECRET_BYTES / seconds_of(sight)


def recover(parameters: Values, seed: int) -> dict[str, Scalar]:
    """Whether the key was `recovered` in one rollout, and whether a `wrong` one was accepted."""
    sight = SIGHTS[str(parameters["sight"])]
    draw = np.random.default_rng([_STREAM, seed])
    key = _fleet(draw.bytes(32))
    anchor, played_on = anchor_of(key), _DAY + timedelta(1)
    noon = datetime(played_on.year, played_on.month, played_on.day, 12, tzinfo=UTC)
    disclosed = disclosed_key(key, _DAY, noon)
    public = public_key(anchor)
    # A slot's start, so that the film's length is that of the message.
    message_s = public.scheme.message_ticks / public.scheme.rate_hz
    unix_s = (noon.timestamp() + 60.0 * float(draw.integers(300))) // message_s * message_s - _LEAD_S
    end_s = _LEAD_S + sight.part * message_s + _TAIL_S
    settings = RunSettings(
        key=public, symbols=None, payload=link_to_carry(anchor, disclosed, noon), seconds=end_s + 0.1, seed=seed,
        wire="direct", start_s=_LEAD_S, unix_s=unix_s, task=random_task,
    )  # fmt: skip
    tracks = motion_capture_tracks(run_lockstep(settings), seed, MotionCapture())
    seen = [track for number, track in enumerate(tracks) if (number - seed) % len(tracks) < sight.robots]
    error_s = float(draw.uniform(-_CLOCK_ERROR_S, _CLOCK_ERROR_S))
    at = RecordedAt(unix_s + error_s, _CLOCK_ERROR_S)
    decoding = decode_tracks(seen, public, DecodeSettings(at=at))
    recovered = wrong = False
    if decoding.verdict == "decoded":
        assert isinstance(decoding.message, bytes)
        try:
            found = carried_key(anchor, decoding.message, played_on).holding.channel_secret
        except MtmError:
            pass
        else:
            epoch = epoch_of_day(_DAY, key.scheme)
            recovered = found(epoch, 0) == key.holding.channel_secret(epoch, 0)
            wrong = not recovered
    return {"decoded": decoding.verdict == "decoded", "recovered": recovered, "wrong": wrong}


def _fleet(secret: bytes) -> Key:
    """A master of ten days around the day."""
    scheme = tagged_scheme()
    grant = Grant(
        kind="master", channels=tuple(channel.name for channel in scheme.channels),
        first_day=_DAY - timedelta(5), last_day=_DAY + timedelta(4), serial="0" * 16,
    )  # fmt: skip
    return Key("fleet", MasterHolding(grant, tree_of("fleet", scheme), scheme, secret), scheme)
