"""`mtm-hil real`: messages added to recorded motion, and what is read of them."""

import hashlib
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from rich.console import Console

from hil.experiments.detectors.body_frame import known_headings
from hil.experiments.real.added import Frame
from hil.experiments.real.rollout import DETECTORS, RealJob, job_parameters, read_real, recorded_track
from hil.experiments.runs.cells import Cell, CellStore, Values
from hil.experiments.runs.proportion import Proportion
from hil.experiments.runs.result_file import write_result_csv
from hil.experiments.runs.sweep import run_sweep
from mtm_audit.ingest.recording import recording_files
from mtm_onboard.protocol import MtmError
from mtm_onboard.protocol.errors import WrongValueError

_COLUMNS = (
    "recording", "frame", "sigma", "seed", "symbol", "start_s", "onset_s", "delay_s", "natural_hz", "damping", "gain",
    "rate_scale", "verdict", "likeliest_right", "bits", "windows", "matched", "coherency", "genie",
    "genie_sure",
)  # fmt: skip


@dataclass(frozen=True, kw_only=True)
class RealOptions:
    """What the command line asked for: `messages` on each recording in each frame and at each sigma."""

    folder: Path
    messages: int
    frames: tuple[Frame, ...]
    sigmas: tuple[float, ...]
    alphabet_size: int
    window_s: float
    seconds: float
    band_hz: tuple[float, float]
    threshold: float
    onset_known: bool
    seed: int
    workers: int | None
    out: Path | None
    cells: Path


def real(options: RealOptions, console: Console) -> None:
    """Measure, print and, where asked, write the table; raises MtmError when nothing in the folder can be used."""
    CellStore.check(options.cells)
    files = _files(options.folder)
    jobs = [_job(options, frame, sigma) for sigma in options.sigmas for frame in options.frames]
    rows: list[tuple[object, ...]] = []
    notes: list[str] = []
    with CellStore(options.cells) as store:
        for job in jobs:
            usable = [path for path in files if _fits(path, job)]
            cells = [
                _cell(path, job, options.seed + files.index(path) * options.messages + number)
                for path in usable
                for number in range(options.messages)
            ]
            results = run_sweep(read_real, cells, store, console, options.workers)
            rows += [_row(job, cell, result) for cell, result in zip(cells, results, strict=True)]
            notes += _summary(job, cells, results)
            print("\n".join(notes[-2:] if cells else notes[-1:]))
    if options.out is not None:
        write_result_csv(options.out, _command(options), _COLUMNS, rows, notes)
        print(f"wrote {options.out}")


def band_of(text: str) -> tuple[float, float]:
    """The band from its two ends, LOW:HIGH in Hz; raises MtmError when these are not two numbers."""
    low, _, high = text.partition(":")
    try:
        return float(low), float(high)
    except ValueError as error:
        raise WrongValueError(f"the band {text!r} is not LOW:HIGH in Hz; give one such as 0.5:4") from error


def _files(folder: Path) -> list[Path]:
    """The motion-capture files, each of which can be read; raises MtmError when one cannot, or there is none."""
    files, kind = recording_files([folder])
    if kind == "video":
        raise MtmError(f"{folder} is a video; name a folder of trajectories, TUM or CSV files")
    for path in files:
        recorded_track(path, _digest(path))
    return list(files)


def _fits(path: Path, job: RealJob) -> bool:
    """Whether the recording has what the job asks for; a reason is printed when it has not."""
    track = recorded_track(path, _digest(path))
    try:
        if job.frame == "body":
            known_headings(track)
    except MtmError:
        print(f"{path.name} has no heading, so it is left out in the body's frame")
        return False
    if (lasts_s := float(track.times_s[-1] - track.times_s[0])) < 3.0 * job.window_s:
        print(f"{path.name} lasts {lasts_s:.1f} s only and is left out; it takes three windows of {job.window_s:g} s")
        return False
    return True


def _job(options: RealOptions, frame: Frame, sigma: float) -> RealJob:
    job = RealJob(
        frame=frame,
        sigma=sigma,
        alphabet_size=options.alphabet_size,
        window_s=options.window_s,
        seconds=options.seconds,
        band_hz=options.band_hz,
        threshold=options.threshold,
        onset_known=options.onset_known,
    )
    if job.seconds < 3.0 * job.window_s:
        raise MtmError(f"pieces of {job.seconds:g} s hold fewer than three windows of {job.window_s:g} s; take longer")
    _ = job.scheme
    return job


def _cell(path: Path, job: RealJob, seed: int) -> Cell:
    return Cell("real", {"path": str(path), "digest": _digest(path), **job_parameters(job)}, seed)


def _digest(path: Path) -> str:
    return hashlib.sha256(path.read_bytes()).hexdigest()[:16]


def _row(job: RealJob, cell: Cell, result: Values) -> tuple[object, ...]:
    given = {"recording": Path(str(cell.parameters["path"])).stem, "frame": job.frame, "sigma": job.sigma,
             "seed": cell.seed}  # fmt: skip
    values = {**given, **result}
    return tuple(f"{v:.7g}" if isinstance(v, float) else v for v in (values[name] for name in _COLUMNS))


def _summary(job: RealJob, cells: Sequence[Cell], results: Sequence[Values]) -> list[str]:
    """The job in two sentences: verdicts with evidence, and windows."""
    name = f"{job.frame} frame, sigma {job.sigma:g} m/s, {job.seconds:g} s"
    if not cells:
        return [f"{name}: no recording to measure"]
    verdicts = [str(result["verdict"]) for result in results]
    wrong = sum(result["verdict"] == "decoded" and not result["likeliest_right"] for result in results)
    likeliest = sum(bool(result["likeliest_right"]) for result in results)
    bits = np.sort([float(result["bits"]) for result in results])
    sure = sum(bool(result["genie_sure"]) for result in results)
    recordings = len({cell.parameters["path"] for cell in cells})
    decoded = Proportion(verdicts.count("decoded"), len(results))
    low, high = decoded.interval_percent
    others = "".join(f", {verdicts.count(v)} {v}" for v in ("inconclusive", "absent", "refused") if v in verdicts)
    said = (
        f"{name}: {decoded.successes} of {decoded.trials} messages on {recordings} recordings decoded at "
        f"{job.threshold:g} [{low:.0f}-{high:.0f} %], {wrong} of them wrong{others}; likeliest symbol right "
        f"{likeliest}, genie sure of it {sure}; evidence {bits[0]:.1f} to {bits[-1]:.1f} bits, median "
        f"{np.median(bits):.1f}"
    )
    windows = sum(int(result["windows"]) for result in results)
    if not windows:
        return [said, f"{name}: no piece shows a window"]
    shares = [
        f"{detector} {Proportion(sum(int(result[detector]) for result in results), windows)}"
        for detector in (*DETECTORS, "genie")
    ]
    return [said, f"{name}: windows right, onset known, % of {windows}: {', '.join(shares)}"]


def _command(options: RealOptions) -> str:
    frames = [f"--frame {frame}" for frame in options.frames]
    sigmas = [f"--sigma {sigma:g}" for sigma in options.sigmas]
    low, high = options.band_hz
    return " ".join([
        f"mtm-hil real {options.folder.name} -n {options.messages}", *frames, *sigmas,
        f"--alphabet {options.alphabet_size} --window {options.window_s:g} --seconds {options.seconds:g}",
        f"--band {low:g}:{high:g} --threshold {options.threshold:g}", *(["--onset-known"] * options.onset_known),
        f"--seed {options.seed}",
    ])  # fmt: skip
