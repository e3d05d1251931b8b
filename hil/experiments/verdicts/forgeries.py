"""Forgeries against keys as `mtm-onboard keygen` makes them: how many of each kind are authenticated.

Each try is a film that an auditor of its day reads. The costly part of a decode is the evidence, and without a right
tag nothing is authenticated whatever the evidence says; so films of one robot are weighed only where a frame that the
detector reads has a right tag. Controls, and films of several robots, whose tracks the evidence may exchange, are
always decoded whole.
"""

from datetime import UTC, datetime

import numpy as np

from hil.experiments.runs.cells import Cell, Scalar, Values
from hil.experiments.verdicts.forgers import ATTACKS, ERROR_S, PRELUDE_S, STREAM, Film, Fleet, holder_of
from hil.plants.responses import Floats, lag
from mtm_audit.decoding.decode import decode_tracks
from mtm_audit.decoding.frames import Heard, decode_frames
from mtm_audit.decoding.leaps import without_leaps
from mtm_audit.decoding.settings import DecodeSettings
from mtm_audit.decoding.start import start_of
from mtm_audit.detectors.base import ChannelReading, Observation
from mtm_audit.detectors.matched.detector import MatchedDetector
from mtm_audit.model.glimpse import glimpse_of_track
from mtm_audit.model.recorded_at import RecordedAt
from mtm_audit.model.track import Track
from mtm_audit.reporting.basis import basis_of
from mtm_onboard.protocol import Key, MtmError
from mtm_onboard.protocol.slots import slot_at

FORGED, CONTROL = "forged", "control"
COUNTS = ("tries", "right tags", "decoded", "authenticated", "refused")
"""What is counted of each attack; refused are films that could not be read at all."""
_AFTER_S = 1.0
_LAG_S, _SLIP_MPS, _NOISE_M = 0.1, 0.02, 0.0005
_PER_CELL = 20
# One that is always decoded whole costs several times as much.
_COSTLY_PART = 16
_CONTROL_PART = 100


def forgery_cells(tries: int, first_seed: int) -> list[Cell]:
    """Cells of every attack in turn, with `tries` in total at least, and a hundredth as many of each one's control."""
    costly = [name for name, attack in ATTACKS.items() if len(attack.scheme.channels) > 1]
    few = -(-tries // _COSTLY_PART)
    each = -(-(tries - few * len(costly)) // (len(ATTACKS) - len(costly)))
    cells = []
    for name in ATTACKS:
        for role, count in ((FORGED, few if name in costly else each), (CONTROL, -(-each // _CONTROL_PART))):
            sizes = [min(_PER_CELL, count - begun) for begun in range(0, count, _PER_CELL)]
            cells += [
                Cell("forgeries", {"attack": name, "role": role, "tries": size}, first_seed + number)
                for number, size in enumerate(sizes)
            ]
    return sorted(cells, key=lambda cell: cell.seed)


def try_forgeries(parameters: Values, seed: int) -> dict[str, Scalar]:
    """How many films of one attack, or of its control, had a right tag, were decoded, authenticated, or refused."""
    counts = dict.fromkeys(COUNTS, 0)
    for number in range(int(parameters["tries"])):
        counts["tries"] += 1
        for result in one_try(str(parameters["attack"]), str(parameters["role"]), seed * 1000 + number):
            counts[result] += 1
    return dict(counts)


def one_try(name: str, role: str, seed: int) -> tuple[str, ...]:
    """What became of one film, as in `COUNTS`; a film that showed no right tag gets no other word."""
    attack = ATTACKS[name]
    scheme, make = (attack.scheme, attack.forge) if role == FORGED else (attack.control_scheme, attack.control)
    draw = np.random.default_rng([STREAM, sorted(ATTACKS).index(name), role == FORGED, seed])
    at_s = datetime(2026, 11, 30, 1, tzinfo=UTC).timestamp() + float(draw.uniform(0.0, 22 * 3600.0))
    fleet = Fleet(holder_of(int(draw.integers(0, 4)), scheme), scheme, slot_at(at_s, scheme), draw)
    return decoded(make(fleet), fleet, in_full=role == CONTROL)


def decoded(film: Film, fleet: Fleet, *, in_full: bool = True) -> tuple[str, ...]:
    """What an auditor of the film's day makes of it, as in `COUNTS`.

    Unless `in_full`, a film of one robot that shows no right tag is decoded no further and gets no word.
    """
    scheme, at, auditor = fleet.scheme, RecordedAt(film.began_unix_s, ERROR_S), fleet.key
    if not isinstance(fleet.holder, bytes):
        day = datetime.fromtimestamp(film.began_unix_s, UTC).date()
        auditor = Key("fake-fleet", fleet.holder.for_auditor(day, day), scheme)
    bodies = zip(scheme.channels, film.noise, strict=True)
    tracks = [filmed(channel.body, noise, fleet.draw) for channel, noise in bodies]
    try:
        if not in_full and len(tracks) == 1 and not shows_a_right_tag(tracks[0], auditor, at):
            return ()
        return _decoded(tracks, auditor, at)
    except MtmError:
        return ("refused",)


def shows_a_right_tag(track: Track, key: Key, at: RecordedAt) -> bool:
    """Whether the tag of a frame that the detector reads in a robot's track is right, whatever the evidence says.

    This is what `decode_tracks` reads before it weighs it. Raises MtmError when the track cannot be read.
    """
    scheme = key.scheme
    start = start_of(scheme, [track], None, at)
    observation = Observation(scheme.channels[0], glimpse_of_track(without_leaps(track).track))
    (result,) = MatchedDetector().read(key.codebook(start.first_slot), [], [observation], start.onset)
    if not isinstance(result, ChannelReading):
        raise result
    heard = [Heard(scheme.channels[0], result)]
    frames = decode_frames(heard, scheme, key.secret, start.first_slot, order_known=True)
    return any(frame.message.authenticated for frame in frames)


def _decoded(tracks: list[Track], key: Key, at: RecordedAt) -> tuple[str, ...]:
    # Under the fixed schedule no clock says where a message begins.
    onset_s = PRELUDE_S if key.scheme.schedule == "fixed" else None
    decoding = decode_tracks(tracks, key, DecodeSettings(at=at, onset_s=onset_s))
    words = []
    right = any(frame.message.authenticated for frame in decoding.frames)
    if right:
        words.append("right tags")
    if decoding.verdict == "decoded":
        words.append("decoded")
        # What the report calls authenticated, which also asks whether each robot was heard.
        if right and basis_of(decoding, key.holding.grant, None).authenticates:
            words.append("authenticated")
    return tuple(words)


def filmed(name: str, noise: Floats, draw: np.random.Generator) -> Track:
    """A body that begins to play a second after the film does, as motion capture sees it at the robots' rate."""
    step_s = 0.05
    times_s = np.arange(round((PRELUDE_S + _AFTER_S) / step_s) + len(noise), dtype=np.float64) * step_s
    before = round(PRELUDE_S / step_s)
    played = np.zeros((len(times_s), noise.shape[1]))
    played[before : before + len(noise)] = noise
    task = 0.3 * np.cos(2.0 * np.pi * (times_s[:, None] * draw.uniform(0.03, 0.1, 2) + draw.random(2)))
    slip = _SLIP_MPS * draw.standard_normal(played.shape)
    velocities = lag(step_s, _LAG_S).advance(played + task) + slip
    positions = np.cumsum(velocities, axis=0) * step_s + _NOISE_M * draw.standard_normal(played.shape)
    return Track(name, times_s, positions, np.ones(len(times_s), dtype=np.bool_))
