"""Recordings that no key asked had a part in, hostile or dull, to see what is taken for a message in them."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from hil.fleet.driven import sent_track
from hil.fleet.sending import STEP_S, Sending
from hil.plants.family import ROBOMASTER
from hil.plants.responses import Floats, lag
from hil.worlds.vehicles import VEHICLES
from mtm_audit.model.recorded_at import RecordedAt
from mtm_audit.model.track import FARTHEST, Track
from mtm_onboard.protocol import Channel, Codebook, Scheme
from mtm_onboard.protocol.scheme import Power, Schedule
from mtm_onboard.protocol.slots import next_slot, slot_start_unix_s
from mtm_onboard.protocol.waveform import tone_bins

_ALPHABET, _WINDOW_TICKS, _BAND_HZ, _RATE_HZ, _SIGMA = 4, 100, (0.5, 5.0), 50.0, 0.1
# Two messages of one symbol, or one of two; evidence costs by the window and by the second.
_SHORTEST_S, _LONGEST_S = 4.6, 5.6
# Under a rolling schedule: about when recordings begin, and by how much clocks may be off.
_UNIX_S, _CLOCK_ERROR_S = 1.75e9, 1.5
_CROWD = 100
# A slope in the band and a faint tone at its edge.
_SPECTRUM = ((0.5, -20.0), (0.75, 6.0), (5.0, -6.0))


@dataclass(frozen=True)
class Recording:
    """What is asked of each key: `tracks` to be read under `scheme`, from `onset_s` on (None: at an unknown time).

    `at` says when a recording under a rolling schedule was made.
    """

    tracks: tuple[Track, ...]
    scheme: Scheme
    onset_s: float | None
    at: RecordedAt | None


# A recording's scheme and the source of all its randomness to its tracks.
_Maker = Callable[[Scheme, np.random.Generator], Sequence[Track]]


def hostile_recording(kind: str, number: int, seed: int) -> Recording:
    """The recording of that kind and number, the same for the same seed.

    Even ones are read from a known onset. Sixteen that follow each other, the kinds' first ones two apart, have each
    law of the tones, each schedule, and one and two symbols a message; every third one's noise has a spectrum.
    """
    row = list(KINDS).index(kind)
    draw = np.random.default_rng([seed, row, number])
    turn = 2 * row + number
    power: Power = "window" if turn // 2 % 2 == 0 else "ensemble"
    schedule: Schedule = "fixed" if turn // 4 % 2 == 0 else "rolling"
    symbols = 1 + turn // 8 % 2
    maker, robots = KINDS[kind]
    names = [f"robot{robot}" for robot in range(robots)]
    channels = tuple(Channel(name, name, ("vx", "vy"), symbols, _SIGMA) for name in names)
    scheme = Scheme(name="hostile", rate_hz=_RATE_HZ, band_hz=_BAND_HZ, alphabet_size=_ALPHABET,
                    message_ticks=symbols * _WINDOW_TICKS, channels=channels, power=power,
                    schedule=schedule, spectrum=_SPECTRUM if turn % 3 == 2 else None)  # fmt: skip
    known_s = float(draw.uniform(0.0, 1.0))
    onset_s = known_s if number % 2 == 0 else None
    return Recording(tuple(maker(scheme, draw)), scheme, onset_s, _recorded_at(scheme, onset_s))


def _recorded_at(scheme: Scheme, onset_s: float | None) -> RecordedAt | None:
    """So that a slot begins at a known onset; at an unknown one at some time that is known to a second or two."""
    if scheme.schedule == "fixed":
        return None
    slot = next_slot(_UNIX_S, scheme)
    return RecordedAt(slot_start_unix_s(slot, scheme) - (onset_s or 0.0), _CLOCK_ERROR_S)


def _times_s(draw: np.random.Generator) -> Floats:
    return np.arange(round(float(draw.uniform(_SHORTEST_S, _LONGEST_S)) / STEP_S), dtype=np.float64) * STEP_S


def _track(times_s: Floats, positions: Floats) -> Track:
    return Track("robot0", times_s, positions, np.ones(len(times_s), dtype=np.bool_))


def _line(_scheme: Scheme, draw: np.random.Generator) -> list[Track]:
    times_s = _times_s(draw)
    return [_track(times_s, times_s[:, None] * draw.uniform(-1.0, 1.0, 2))]


def _sine(_scheme: Scheme, draw: np.random.Generator) -> list[Track]:
    """One tone of the band on each axis, free of noise."""
    times_s = _times_s(draw)
    turns = times_s[:, None] * draw.uniform(*_BAND_HZ, 2) + draw.uniform(0.0, 1.0, 2)
    return [_track(times_s, 0.1 * np.cos(2.0 * np.pi * turns))]


def _comb(_scheme: Scheme, draw: np.random.Generator) -> list[Track]:
    """Every tone that a waveform may have, all alike loud."""
    times_s = _times_s(draw)
    tones_hz = tone_bins(_WINDOW_TICKS, _RATE_HZ, _BAND_HZ) * (_RATE_HZ / _WINDOW_TICKS)
    turns = times_s[:, None, None] * tones_hz + draw.uniform(0.0, 1.0, (2, len(tones_hz)))
    velocities = 0.1 * np.cos(2.0 * np.pi * turns).sum(axis=-1)
    return [_track(times_s, np.cumsum(velocities, axis=0) * STEP_S)]


def _steps(_scheme: Scheme, draw: np.random.Generator) -> list[Track]:
    """Stands, and is suddenly elsewhere."""
    times_s = _times_s(draw)
    moves = (draw.random((len(times_s), 2)) < 0.02) * draw.standard_normal((len(times_s), 2))
    return [_track(times_s, np.cumsum(moves, axis=0))]


def _impulses(_scheme: Scheme, draw: np.random.Generator) -> list[Track]:
    """Motion with single positions as far away as a track may hold."""
    times_s = _times_s(draw)
    positions = np.cumsum(0.002 * draw.standard_normal((len(times_s), 2)), axis=0)
    places = draw.choice(len(times_s), int(draw.integers(1, 30)), replace=False)
    positions[places] = FARTHEST * draw.choice((-1.0, 1.0), (len(places), 2))
    return [_track(times_s, positions)]


def _quantised(scheme: Scheme, draw: np.random.Generator) -> list[Track]:
    """Positions on a grid so coarse that they seldom change."""
    (track,) = _another_key(scheme, draw)
    grain_m = float(draw.choice((0.01, 0.05, 0.2)))
    return [replace(track, positions=np.round(track.positions / grain_m) * grain_m)]


def _gaps(scheme: Scheme, draw: np.random.Generator) -> list[Track]:
    """Unseen in a regular pattern, at random, and for a long while."""
    (track,) = _another_key(scheme, draw)
    rows = np.arange(len(track.times_s))
    hidden = draw.random(len(rows)) < 0.3
    hidden |= rows % int(draw.integers(3, 40)) < 2
    begin = int(draw.integers(0, len(rows) // 2))
    hidden[begin : begin + 100] = True
    positions = np.where(hidden[:, None], np.nan, track.positions)
    return [replace(track, positions=positions, valid=~hidden)]


def _crowd(scheme: Scheme, draw: np.random.Generator) -> list[Track]:
    """The waveforms of a hundred other keys, added up."""
    times_s, channel = _times_s(draw), scheme.channels[0]
    total = np.zeros((len(times_s), 2))
    for _ in range(_CROWD):
        symbols = tuple(int(symbol) for symbol in draw.integers(0, _ALPHABET, channel.symbols))
        sending = _sending(draw.bytes(32), scheme, channel, symbols, onset_s=float(draw.uniform(-4.0, 0.0)))
        total += sending.noise(times_s)
    return [_track(times_s, np.cumsum(lag(STEP_S, 0.1).advance(total), axis=0) * STEP_S)]


def _another_key(scheme: Scheme, draw: np.random.Generator) -> list[Track]:
    """Each robot sends a message of a key that is not asked."""
    secret = draw.bytes(32)
    tracks = []
    for channel in scheme.channels:
        symbols = tuple(int(symbol) for symbol in draw.integers(0, _ALPHABET, channel.symbols))
        sending = _sending(secret, scheme, channel, symbols, onset_s=0.5)
        seconds = _SHORTEST_S if len(scheme.channels) > 1 else float(draw.uniform(_SHORTEST_S, _LONGEST_S))
        tracks.append(sent_track(channel.body, VEHICLES[ROBOMASTER], [sending], seconds, draw))
    return tracks


def _exchanged(scheme: Scheme, draw: np.random.Generator) -> list[Track]:
    """Two robots that send a message of another key, under each other's name."""
    one, other = _another_key(scheme, draw)
    return [replace(one, name=other.name), replace(other, name=one.name)]


def _splices(scheme: Scheme, draw: np.random.Generator) -> list[Track]:
    """Pieces of four recordings, some played backwards, put together where the last one ended."""
    pieces = []
    for _ in range(4):
        (track,) = _another_key(scheme, draw)
        steps = np.diff(track.positions, axis=0)[: len(track.times_s) // 4]
        pieces.append(steps[::-1] if draw.random() < 0.5 else steps)
    steps = np.concatenate(pieces)
    return [_track(np.arange(len(steps), dtype=np.float64) * STEP_S, np.cumsum(steps, axis=0))]


def _sending(secret: bytes, scheme: Scheme, channel: Channel, symbols: tuple[int, ...], onset_s: float) -> Sending:
    return Sending(
        codebook=Codebook(secret, scheme), channel=channel, symbols=symbols, onset_s=onset_s, messages=100, sigma=_SIGMA
    )


# Each kind with how it is made and how many robots it shows.
KINDS: dict[str, tuple[_Maker, int]] = {
    "straight line": (_line, 1),
    "sine": (_sine, 1),
    "comb": (_comb, 1),
    "steps": (_steps, 1),
    "impulses": (_impulses, 1),
    "quantised": (_quantised, 1),
    "gaps": (_gaps, 1),
    "crowd": (_crowd, 1),
    "another key": (_another_key, 1),
    "exchanged robots": (_exchanged, 2),
    "splices": (_splices, 1),
}
