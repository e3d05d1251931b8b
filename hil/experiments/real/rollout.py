"""One message added to a piece of a recorded motion, and what is read of it.

A robot that repeats a message of one symbol: key, symbol, plant, clock, the piece and the onset within it are drawn
from the seed. The verdict comes from a decode that searches for the onset; the windows are counted in one that is told.
"""

from collections.abc import Mapping
from dataclasses import asdict, dataclass, replace
from functools import lru_cache
from pathlib import Path

import numpy as np
from scipy.special import softmax

from hil.experiments.detectors.body_frame import known_headings
from hil.experiments.detectors.linear_genie import (
    GenieKnowledge,
    axis_motion,
    fit_interference,
    genie_scores,
    moved_by_responses,
)
from hil.experiments.real.added import Frame, with_message
from hil.experiments.runs.cells import Scalar, Values
from hil.fleet.sending import Sending
from hil.plants.linear_response import LinearResponse, draw_response
from mtm_audit.decoding.decode import decode_tracks
from mtm_audit.decoding.settings import DecodeSettings
from mtm_audit.ingest.load import load_tracks
from mtm_audit.model.track import Floats, Track
from mtm_onboard.protocol import Channel, Key, MtmError, Scheme

RATE_HZ = 50.0
# Two clocks of quartz, each within fifty millionths of the true rate.
CLOCK_SPREAD = 1e-4
DETECTORS = ("matched", "coherency")

_STREAM = 711
_MESSAGES = 1_000_000


@dataclass(frozen=True, kw_only=True)
class RealJob:
    """One symbol of an alphabet, `window_s` long, repeated through `seconds` of motion at `sigma` (m/s), on vx and vy
    in that frame; `threshold` is how often a verdict may be wrong, and with `onset_known` the decode is told the onset.
    """

    frame: Frame
    sigma: float
    alphabet_size: int
    window_s: float
    seconds: float
    band_hz: tuple[float, float]
    threshold: float
    onset_known: bool

    @property
    def scheme(self) -> Scheme:
        """The scheme of this job; raises MtmError when it cannot be played."""
        return Scheme(
            name="real",
            rate_hz=RATE_HZ,
            band_hz=self.band_hz,
            alphabet_size=self.alphabet_size,
            message_ticks=round(self.window_s * RATE_HZ),
            channels=(Channel("robot", "robot", ("vx", "vy"), 1, self.sigma),),
        )


# The result where a piece shows the robot for less than two windows.
_NOTHING: dict[str, Scalar] = {
    **dict.fromkeys(("onset_s", "delay_s", "natural_hz", "damping", "gain", "rate_scale", "bits"), 0.0),
    **dict.fromkeys(("windows", "genie", *DETECTORS), 0), "verdict": "refused", "likeliest_right": False,
    "genie_sure": False,
}  # fmt: skip


def job_parameters(job: RealJob) -> dict[str, Scalar]:
    """The job as parameters of a cell."""
    low, high = job.band_hz
    return {**{name: value for name, value in asdict(job).items() if name != "band_hz"}, "low_hz": low, "high_hz": high}


def job_of(parameters: Values) -> RealJob:
    """The job that a cell's parameters describe."""
    return RealJob(
        frame="world" if parameters["frame"] == "world" else "body",
        sigma=float(parameters["sigma"]),
        alphabet_size=int(parameters["alphabet_size"]),
        window_s=float(parameters["window_s"]),
        seconds=float(parameters["seconds"]),
        band_hz=(float(parameters["low_hz"]), float(parameters["high_hz"])),
        threshold=float(parameters["threshold"]),
        onset_known=bool(parameters["onset_known"]),
    )


def read_real(parameters: Values, seed: int) -> dict[str, Scalar]:
    """Add a message to the track in `path` and read it: the verdict, whether it is right, evidence, right windows.

    `genie_sure` says whether the genie gives the right symbol, over all windows, a probability of 1 less the threshold.
    """
    job = job_of(parameters)
    track = recorded_track(Path(str(parameters["path"])), str(parameters["digest"]))
    draw = np.random.default_rng([_STREAM, seed])
    scheme = job.scheme
    key = Key("real", draw.bytes(32), scheme)
    symbol = int(draw.integers(job.alphabet_size))
    response = draw_response(draw)
    rate_scale = 1.0 + float(draw.uniform(-CLOCK_SPREAD, CLOCK_SPREAD))
    whole = with_headings_only(track) if job.frame == "body" else track
    silent = piece_of(whole, job.seconds, float(draw.random()))
    shown_s = silent.times_s[silent.valid]
    if len(shown_s) < 3 or np.ptp(shown_s) < 2.0 * job.window_s:
        return {**_NOTHING, "symbol": symbol, "start_s": float(silent.times_s[0])}
    onset_s = float(silent.times_s[0] + draw.uniform(0.0, job.window_s))
    sending = Sending(
        codebook=key.codebook(), channel=scheme.channels[0], symbols=(symbol,), onset_s=onset_s, messages=_MESSAGES,
        sigma=job.sigma, rate_scale=rate_scale,
    )  # fmt: skip
    responses = dict.fromkeys(scheme.channels[0].axes, response)
    seen = with_message(silent, sending, responses, job.frame)
    windows = int((seen.times_s[-1] - onset_s) * rate_scale / job.window_s)
    scores = _genie_scores(silent, seen, sending, responses, job.frame, windows)
    result: dict[str, Scalar] = {
        "symbol": symbol, "start_s": float(silent.times_s[0]), "onset_s": onset_s, "delay_s": response.delay_s,
        "natural_hz": float(response.natural_hz or 0.0), "damping": response.damping, "gain": response.gain,
        "rate_scale": rate_scale, "windows": windows, "genie": int(np.sum(np.argmax(scores, axis=1) == symbol)),
        "genie_sure": bool(softmax(scores.sum(axis=0))[symbol] >= 1.0 - job.threshold),
    }  # fmt: skip
    for detector in DETECTORS:
        result[detector] = right_windows(seen, key, detector, onset_s, windows, symbol)
    return {**result, **_verdict(seen, key, job, onset_s, symbol)}


def _genie_scores(
    silent: Track,
    seen: Track,
    sending: Sending,
    responses: Mapping[str, LinearResponse],
    frame: Frame,
    windows: int,
) -> Floats:
    """(windows, M) by the linear genie; its interference is fitted to the motion before the message was added."""
    axes, highest_hz = sending.channel.axes, sending.codebook.scheme.band_hz[1]
    before, after = (axis_motion(track, axes, highest_hz, body=frame == "body") for track in (silent, seen))
    interference = tuple(fit_interference([before], axis) for axis in range(len(axes)))
    known = GenieKnowledge(moved_by_responses(sending, responses), interference)
    return genie_scores(after, sending, known, windows)


def right_windows(track: Track, key: Key, detector: str, onset_s: float, windows: int, symbol: int) -> int:
    """How many of the first windows a detector that is told the onset decides right, each by itself."""
    # Decoys do not change what the paper's detector scores; it wants some.
    settings = DecodeSettings(detector=detector, onset_s=onset_s, decoys=2 if detector == "coherency" else None)
    try:
        (channel,) = decode_tracks([track], key, settings).channels
    except MtmError:
        return 0
    if channel.reading is None:
        return 0
    numbers, decided = channel.reading.window_numbers, np.argmax(channel.reading.window_scores, axis=1)
    return int(np.sum((decided == symbol) & (numbers >= 0) & (numbers < windows)))


def _verdict(track: Track, key: Key, job: RealJob, onset_s: float, symbol: int) -> dict[str, Scalar]:
    settings = DecodeSettings(threshold=job.threshold, onset_s=onset_s if job.onset_known else None)
    try:
        decoding = decode_tracks([track], key, settings)
    except MtmError as refusal:
        return {"verdict": "refused", "likeliest_right": False, "bits": 0.0, "refusal": str(refusal)}
    return {
        "verdict": decoding.verdict,
        "likeliest_right": decoding.symbols == (symbol,),
        "bits": float(decoding.evidence.bits),
    }


@lru_cache(maxsize=4)
def recorded_track(path: Path, digest: str) -> Track:
    """The one track of a motion-capture file; the digest of its content keeps one file apart from another."""
    tracks = load_tracks(path)
    if len(tracks) != 1 or np.count_nonzero(tracks[0].valid) < 3:
        raise MtmError(f"{path} does not show one body in three samples or more; leave it out of the folder")
    return replace(tracks[0], name="robot")


def piece_of(track: Track, seconds: float, place: float) -> Track:
    """`seconds` of a track, from its beginning with `place` 0 to its end with 1; the whole of a shorter one."""
    first_s = track.times_s[0] + place * max(0.0, track.times_s[-1] - track.times_s[0] - seconds)
    kept = (track.times_s >= first_s) & (track.times_s <= first_s + seconds)
    if not kept.any():
        kept = np.arange(len(track.times_s)) == int(np.searchsorted(track.times_s, first_s))
    headings = None if track.headings_rad is None else track.headings_rad[kept]
    return replace(
        track, times_s=track.times_s[kept], positions=track.positions[kept], valid=track.valid[kept],
        headings_rad=headings,
    )  # fmt: skip


def with_headings_only(track: Track) -> Track:
    """The samples whose heading is known; raises MtmError when these are fewer than three."""
    kept = track.valid & known_headings(track)
    return Track(
        track.name, track.times_s[kept], track.positions[kept], np.ones(int(kept.sum()), bool), track.axes, track.unit,
        None if track.headings_rad is None else track.headings_rad[kept],
    )  # fmt: skip
