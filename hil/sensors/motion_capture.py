"""A motion-capture system: noisy poses at a fixed rate, with gaps, as TUM trajectory files."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from hil.sensors.poses import Occlusion, Trajectory, common_span_s, occluded
from mtm_audit.model.track import Track
from mtm_onboard.protocol.atomicfile import replacing
from mtm_onboard.protocol.errors import MtmError

TUM_HEADER = "# timestamp tx ty tz qx qy qz qw\n"


@dataclass(frozen=True)
class MotionCapture:
    """What the system delivers: sampling rate, Gaussian noise (standard deviations) and gaps.

    Each sample is lost with `dropout_probability`, on its own; `occlusions` are lost spans, in world time.
    """

    rate_hz: float = 100.0
    position_noise_m: float = 0.0005
    heading_noise_rad: float = 0.002
    dropout_probability: float = 0.0
    occlusions: tuple[Occlusion, ...] = ()


def capture(
    system: MotionCapture,
    trajectories: list[Trajectory],
    rng: np.random.Generator,
    start_s: float | None = None,
    end_s: float | None = None,
) -> list[Track]:
    """Record all robots from `start_s` to `end_s` of world time (default: the span that all trajectories cover).

    The tracks (axes x and y in metres, headings) count their times from the start of the recording; lost samples
    are NaN and not valid.
    """
    first_s, last_s = common_span_s(trajectories)
    first_s, last_s = first_s if start_s is None else start_s, last_s if end_s is None else end_s
    # Half a microsecond of slack keeps the last sample of a span that is a whole number of periods.
    times_s = np.arange(int((last_s - first_s) * system.rate_hz + 5e-7 * system.rate_hz) + 1) / system.rate_hz
    tracks = []
    for trajectory in trajectories:
        positions, headings = trajectory.at(first_s + times_s)
        positions = positions + system.position_noise_m * rng.standard_normal(positions.shape)
        headings = headings + system.heading_noise_rad * rng.standard_normal(headings.shape)
        lost = rng.random(len(times_s)) < system.dropout_probability
        lost |= occluded(system.occlusions, trajectory.name, first_s + times_s)
        positions[lost], headings[lost] = np.nan, np.nan
        tracks.append(Track(trajectory.name, times_s, positions, ~lost, headings_rad=headings))
    return tracks


def write_tum(track: Track, path: Path) -> None:
    """Write a track in metres as a TUM trajectory: a header line, then one line per valid sample, with z = 0.

    Raises MtmError when the track has no headings or is not in metres.
    """
    if track.headings_rad is None or track.unit != "m":
        raise MtmError(f"track {track.name!r} lacks headings in metres' frame; a TUM file needs a full pose in metres")
    seen = track.valid
    half = track.headings_rad[seen] / 2
    nothing = np.zeros(int(seen.sum()))
    columns = [track.times_s[seen], *track.positions[seen].T, nothing, nothing, nothing, np.sin(half), np.cos(half)]
    with replacing(path) as temporary, temporary.open("w") as file:
        file.write(TUM_HEADER)
        np.savetxt(file, np.stack(columns, axis=1), fmt="%.6f")


def write_tum_files(tracks: list[Track], folder: Path) -> list[Path]:
    """Write `<name>.tum` for every track into `folder`, which must exist; returns the paths."""
    paths = [folder / f"{track.name}.tum" for track in tracks]
    for track, path in zip(tracks, paths, strict=True):
        write_tum(track, path)
    return paths
