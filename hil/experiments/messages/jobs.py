"""Whole messages received: a framed payload from one robot, with its clock, occlusions and repetitions.

One cell is one rollout of four robots, each with a key and a payload of its own under a rolling schedule, of which one
is read by itself. The recording covers a given number of repetitions and little more, and the auditor knows its time
to half a minute. A message is received when its tag verifies and its payload is the one that was sent.
"""

from dataclasses import dataclass, replace

import numpy as np

from hil.experiments.runs.cells import Scalar, Values
from hil.fleet.lockstep import run_lockstep
from hil.fleet.recording import motion_capture_tracks
from hil.fleet.rig import RunSettings
from hil.plants.mecanum import calibrated_parameters
from hil.sensors.motion_capture import MotionCapture
from hil.worlds.robomaster import ROBOTS, fleet_scheme
from mtm_audit.decoding.frames import Heard, decode_frames
from mtm_audit.decoding.start import start_of
from mtm_audit.detectors.base import ChannelReading, Observation
from mtm_audit.detectors.matched.detector import MatchedDetector
from mtm_audit.model.glimpse import glimpse_of_track
from mtm_audit.model.recorded_at import RecordedAt
from mtm_audit.model.track import Track
from mtm_onboard.protocol import Channel, Key, Scheme
from mtm_onboard.protocol.framing import Framing, Payload
from mtm_onboard.protocol.slots import next_slot, slot_start_unix_s
from mtm_onboard.runtime.message import message_of
from mtm_onboard.runtime.modulator import Modulator

_STREAM = 6
_LEAD_S = 1.0
_TAIL_S = 0.5
# 2026-01-31 12:00:00 UTC; the run begins within a day of it, drawn from the seed.
_NOON_UNIX_S = 1_769_860_800.0
_CLOCK_ERROR_S = 30.0
_PLAIN, _RANDOM, _SAME = "none", "another half each time", "the same half each time"
_DROPS = "a fifth of the frames and one second"
_DROPPED, _HIDDEN_S = 0.2, 1.0
_TEXT_CHARACTERS = "abcdefghijklmnopqrstuvwxyz 0123456789"


@dataclass(frozen=True, kw_only=True)
class Job:
    """What each robot sends, and how much of it is recorded: `windows` symbols of `ticks` each.

    `hidden` is what the recording lacks.
    """

    name: str
    framing: Framing
    windows: int
    alphabet_size: int = 256
    ticks: int = 100
    repetitions: int = 1
    hidden: str = _PLAIN

    @property
    def message_s(self) -> float:
        """Length of one message."""
        return self.windows * self.ticks / 50.0


_NUMBER = Framing("integer", 64, check="tag", check_bits=32, code="reed-solomon", interleave=True)
_TEXT = Framing("text", 128, check="tag", check_bits=32, code="reed-solomon", interleave=True)
_LARGE = 4096
JOBS: dict[str, Job] = {
    job.name: job
    for job in (
        Job(name="64 bits in 24 s", framing=_NUMBER, windows=12, alphabet_size=_LARGE),
        Job(name="64 bits in 32 s", framing=_NUMBER, windows=16),
        Job(name="64 bits in 28 s", framing=_NUMBER, windows=14),
        Job(name="16 bytes of text in 60 s", framing=_TEXT, windows=30),
        Job(
            name="64 bits in 48 s, three times, half hidden", framing=_NUMBER, windows=24, repetitions=3,
            hidden=_RANDOM,
        ),
        Job(
            name="64 bits in 48 s, three times, the same half hidden", framing=_NUMBER, windows=24, repetitions=3,
            hidden=_SAME,
        ),
        Job(name="64 bits in 20 s", framing=_NUMBER, windows=10, alphabet_size=_LARGE),
        Job(name="64 bits in 16 s", framing=replace(_NUMBER, code="none"), windows=8, alphabet_size=_LARGE),
        Job(name="16 bytes of text in 36 s", framing=_TEXT, windows=18, alphabet_size=_LARGE),
        Job(
            name="16 bytes of text in 30 s", framing=replace(_TEXT, code="none"), windows=14, alphabet_size=_LARGE,
            ticks=107,
        ),
        Job(
            name="64 bits in 24 s, a fifth of the frames and one second hidden", framing=_NUMBER, windows=12,
            alphabet_size=_LARGE, hidden=_DROPS,
        ),
    )
}  # fmt: skip


def receive(parameters: Values, seed: int) -> dict[str, Scalar]:
    """Whether one robot's message was `received` in one rollout, and whether a `wrong` one passed the check."""
    job = JOBS[str(parameters["job"])]
    draw = np.random.default_rng([_STREAM, seed])
    fleet = _fleet_scheme(job)
    keys = {channel.name: Key("robot", draw.bytes(32), _own_scheme(fleet, channel, job)) for channel in fleet.channels}
    payloads = {name: _payload(job.framing, draw) for name in keys}
    unix_s = _NOON_UNIX_S + float(draw.uniform(0.0, 86_400.0))
    onset_s = slot_start_unix_s(next_slot(unix_s + _LEAD_S, fleet), fleet) - unix_s
    end_s = onset_s + job.repetitions * job.message_s + _TAIL_S
    settings = RunSettings(
        key=Key("fleet", bytes(32), fleet),
        symbols=_silence(fleet),
        seconds=end_s + 0.1,
        seed=seed,
        wire="direct",
        start_s=_LEAD_S,
        unix_s=unix_s,
        plant=calibrated_parameters(),
        modulator=lambda codebook, name, _: Modulator(
            keys[name].codebook(codebook.first_slot), name, message_of(payloads[name], keys[name])
        ),
    )
    tracks = motion_capture_tracks(run_lockstep(settings), seed, MotionCapture())
    robot = seed % ROBOTS
    name = fleet.channels[robot].name
    seen = _observed_track(tracks[robot], onset_s, end_s, job, draw)
    error_s = float(draw.uniform(-_CLOCK_ERROR_S, _CLOCK_ERROR_S))
    found = _read(seen, keys[name], RecordedAt(unix_s + error_s, _CLOCK_ERROR_S))
    return {"received": payloads[name] in found, "wrong": any(payload != payloads[name] for payload in found)}


def _fleet_scheme(job: Job) -> Scheme:
    plain = fleet_scheme(job.windows * job.ticks)
    channels = tuple(replace(channel, symbols=job.windows) for channel in plain.channels)
    return replace(plain, alphabet_size=job.alphabet_size, channels=channels, schedule="rolling")


def _own_scheme(fleet: Scheme, channel: Channel, job: Job) -> Scheme:
    return replace(fleet, channels=(channel,), framing=job.framing)


def _silence(fleet: Scheme) -> tuple[int, ...]:
    """Symbols for the rig's settings; each robot's own modulator sends its own message instead."""
    return (0,) * fleet.message_symbols


def _payload(framing: Framing, draw: np.random.Generator) -> Payload:
    if framing.payload == "integer":
        return int.from_bytes(draw.bytes(framing.payload_bits // 8), "big")
    letters = draw.choice(list(_TEXT_CHARACTERS), framing.payload_bits // 8)
    return "".join(letters.tolist())


def _observed_track(track: Track, onset_s: float, end_s: float, job: Job, draw: np.random.Generator) -> Track:
    """The recording from shortly before the message, without what the job hides."""
    rows = (track.times_s >= onset_s - _LEAD_S + 0.1) & (track.times_s <= end_s)
    times_s, positions, valid = track.times_s[rows], track.positions[rows], track.valid[rows].copy()
    begin = float(draw.random())
    if job.hidden == _DROPS:
        hidden_s = onset_s + begin * (job.message_s - _HIDDEN_S)
        valid &= (draw.random(len(times_s)) >= _DROPPED) & ~((times_s >= hidden_s) & (times_s < hidden_s + _HIDDEN_S))
    for repetition in range(job.repetitions if job.hidden in (_RANDOM, _SAME) else 0):
        begin = begin if job.hidden == _SAME else float(draw.random())
        phase = ((times_s - onset_s) / job.message_s - repetition - begin) % 1.0
        inside = (times_s >= onset_s + repetition * job.message_s) & (
            times_s < onset_s + (repetition + 1) * job.message_s
        )
        valid &= ~(inside & (phase < 0.5))
    return replace(
        track, times_s=times_s, positions=np.where(valid[:, None], positions, np.nan), valid=valid, headings_rad=None
    )


def _read(track: Track, key: Key, at: RecordedAt) -> list[Payload]:
    """The payloads whose tag verifies."""
    start = start_of(key.scheme, [track], None, at)
    (channel,) = key.scheme.channels
    observations = [Observation(channel, glimpse_of_track(track))]
    (reading,) = MatchedDetector().read(key.codebook(start.first_slot), [], observations, start.onset)
    if not isinstance(reading, ChannelReading):
        return []
    frames = decode_frames([Heard(channel, reading)], key.scheme, key.secret, start.first_slot, order_known=True)
    return [
        frame.message.payload for frame in frames if frame.message.authenticated and frame.message.payload is not None
    ]


def payload_bps(job: Job) -> float:
    """Payload bits a second of one repetition."""
    return job.framing.payload_bits / job.message_s
