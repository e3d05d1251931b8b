"""Whether a message is seen in a robot's motion without the key, and told from other noise of its band.

There are two noises of the same band and power: a stationary one, and one of the message's law that no key has drawn.

A linear discriminant, as in `hil.experiments.attacks.steganalysis`, is trained on half of the drives, labelled, and
ranks the others in pairs, one drive with a message and one without. The share of pairs ranked rightly is the area under
the ROC curve (AUC); pairs have no drive in common, so that its interval is exact. There are two readers: one takes the
powers in eight bands of each axis below 5 Hz; the other knows the scheme but its key, and when its windows begin, and
takes how loud the band is in a window, on the average and by how much that differs from window to window.
"""

import json
import tomllib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from rich.console import Console

from hil.experiments.attacks.steganalysis import band_powers, ranked_higher
from hil.experiments.runs.cells import Cell, CellStore, Scalar, Values
from hil.experiments.runs.proportion import Proportion
from hil.experiments.runs.sweep import run_sweep
from hil.experiments.task.drive import Course, course
from hil.experiments.task.noise import CLEAN, KEYED, SAME_BAND, SAME_LAW
from hil.sensors.motion_capture import MotionCapture
from mtm_audit.model.track import Floats
from mtm_onboard.model.velocity import AXES
from mtm_onboard.protocol import Scheme
from mtm_onboard.protocol.scheme import scheme_from_table
from mtm_onboard.protocol.schemefile import scheme_text

AGAINST = (CLEAN, SAME_BAND, SAME_LAW)
BANDS, WINDOWS = "bands", "windows"
READERS = (BANDS, WINDOWS)
# Of the beginning of a drive; the shortest takes longer.
LENGTHS_S = (6.0, 12.0, 24.0)

_KINDS = (KEYED, *AGAINST)
_SEEN_HZ = 10.0
# Drives in one cell.
_BATCH = 10
_SENSOR_STREAM = 10
# Drives of other kinds are on other seeds, as far apart.
_APART = 100_000


@dataclass(frozen=True, kw_only=True)
class Presence:
    """How many pairs of one scheme's drives and those `against` one reader ranks rightly after so many seconds."""

    scheme: str
    plant: str
    against: str
    reader: str
    seconds: float
    ranked: Proportion


def measure_presence(
    schemes: Mapping[str, Scheme],
    plant: str,
    drives: int,
    first_seed: int,
    store: CellStore,
    console: Console,
    *,
    workers: int | None = None,
) -> list[Presence]:
    """Each scheme's noise, by its name, on that plant; at least four drives under each kind of noise."""
    asked = [
        (name, kind, _cell(scheme, kind, plant, first_seed + _APART * place + first, min(_BATCH, drives - first)))
        for name, scheme in schemes.items()
        for place, kind in enumerate(_KINDS)
        for first in range(0, drives, _BATCH)
    ]
    results = run_sweep(drive_features, [cell for *_, cell in asked], store, console, workers)
    found: dict[tuple[str, str, str], list[list[float]]] = {}
    for (name, kind, _), result in zip(asked, results, strict=True):
        for what, text in result.items():
            found.setdefault((name, kind, what), []).extend(json.loads(str(text)))
    return [
        _presence(name, plant, against, reader, seconds, found)
        for name in schemes
        for against in AGAINST
        for reader in READERS
        for seconds in LENGTHS_S
        if (name, against, _what(reader, seconds)) in found
    ]


def _presence(
    name: str, plant: str, against: str, reader: str, seconds: float,
    found: Mapping[tuple[str, str, str], Sequence[Sequence[float]]],
) -> Presence:  # fmt: skip
    keyed, other = (np.array(found[name, kind, _what(reader, seconds)]) for kind in (KEYED, against))
    pairs, higher = ranked_higher(keyed, other)
    return Presence(
        scheme=name, plant=plant, against=against, reader=reader, seconds=seconds, ranked=Proportion(higher, pairs)
    )


def drive_features(parameters: Values, seed: int) -> dict[str, Scalar]:
    """What each reader takes of the drives of `seed` and those after it, as JSON (drives, features), by reader and
    length.
    """
    scheme = scheme_from_table(tomllib.loads(str(parameters["scheme"]))["scheme"])
    plant, kind, drives = str(parameters["plant"]), str(parameters["kind"]), int(parameters["drives"])
    seen = np.stack([
        seen_velocities(course(scheme, kind, own, plant, max(LENGTHS_S)), scheme.rate_hz, own)
        for own in range(seed, seed + drives)
    ])  # fmt: skip
    features: dict[str, Scalar] = {}
    for seconds in LENGTHS_S:
        part = seen[:, : round(seconds * scheme.rate_hz)]
        features[_what(BANDS, seconds)] = json.dumps(band_powers(_slower(part, scheme.rate_hz)).tolist())
        if part.shape[1] >= 2 * _window_ticks(scheme):
            features[_what(WINDOWS, seconds)] = json.dumps(window_powers(part, scheme).tolist())
    return features


def seen_velocities(driven: Course, rate_hz: float, seed: int) -> Floats:
    """(ticks, 3): velocities ahead and to the left and the turn rate, as motion capture shows them."""
    sensor, draw = MotionCapture(), np.random.default_rng([_SENSOR_STREAM, seed])
    deviations = np.array([sensor.position_noise_m, sensor.position_noise_m, sensor.heading_noise_rad])
    poses = driven.poses + deviations * draw.standard_normal(driven.poses.shape)
    moved = np.diff(poses, axis=0) * rate_hz
    middle = 0.5 * (poses[1:, 2] + poses[:-1, 2])
    cosine, sine = np.cos(middle), np.sin(middle)
    ahead, left = cosine * moved[:, 0] + sine * moved[:, 1], cosine * moved[:, 1] - sine * moved[:, 0]
    return np.stack([ahead, left, moved[:, 2]], axis=1)


def window_powers(velocities: Floats, scheme: Scheme) -> Floats:
    """(drives, 2 x axes with noise): mean and standard deviation over windows of the log power in the band.

    `velocities` (drives, ticks, 3) begin with a window and hold two or more.
    """
    ticks = _window_ticks(scheme)
    count = velocities.shape[1] // ticks
    axes = sorted({AXES.index(axis) for channel in scheme.channels for axis in channel.axes if axis in AXES})
    windows = velocities[:, : count * ticks, axes].reshape(len(velocities), count, ticks, len(axes))
    hz = np.fft.rfftfreq(ticks, 1.0 / scheme.rate_hz)
    inside = (hz >= scheme.band_hz[0]) & (hz <= scheme.band_hz[1])
    power = np.abs(np.fft.rfft(windows, axis=2)[:, :, inside]) ** 2
    loudness = np.log(power.mean(axis=2))
    return np.concatenate([loudness.mean(axis=1), loudness.std(axis=1)], axis=1)


def _slower(velocities: Floats, rate_hz: float) -> Floats:
    """Means over the ticks of each tenth of a second."""
    ticks = round(rate_hz / _SEEN_HZ)
    count = velocities.shape[1] // ticks
    return np.asarray(velocities[:, : count * ticks].reshape(len(velocities), count, ticks, -1).mean(axis=2))


def _window_ticks(scheme: Scheme) -> int:
    return scheme.window_ticks(scheme.channels[0])


def _what(reader: str, seconds: float) -> str:
    return f"{reader} {seconds:g}"


def _cell(scheme: Scheme, kind: str, plant: str, seed: int, drives: int) -> Cell:
    given: dict[str, Scalar] = {"scheme": scheme_text(scheme), "kind": kind, "plant": plant, "drives": drives}
    return Cell("presence", given, seed)
