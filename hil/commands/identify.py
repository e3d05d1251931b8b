"""`mtm-hil identify`: a robot's response and interference from what was commanded and how it moved."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from rich.console import Console
from rich.table import Table

from hil.experiments.identify.fit import fit_interference, fit_response, phase_delay_s
from hil.experiments.identify.logs import LoggedRun, logged_run, read_commands, read_truth
from hil.experiments.identify.profile import MOST_MISSED, axis_response, missed, profile_of
from hil.experiments.identify.spectra import RATE_HZ, CrossSpectra, cross_spectra
from hil.experiments.runs.result_file import provenance, write_result_csv
from hil.plants.plant_file import IdentifiedAxis, IdentifiedPlant, IdentifiedRobot, save_plant
from mtm_audit.detectors.matched.profile import save_profile
from mtm_onboard.model.velocity import AXES
from mtm_onboard.protocol import MtmError

SHOWN_HZ = (0.5, 1.0, 2.0, 3.0)
BAND_HZ = (0.5, 3.0)
# Commands that change less than this never move the robot, m/s or rad/s.
_LEAST_COMMAND = 1e-4
_COLUMNS = (
    "run", "axis", "segments", "phase_delay_s", *(f"gain_{hz:g}_hz" for hz in SHOWN_HZ),
    *(f"coherence_{hz:g}_hz" for hz in SHOWN_HZ), "unexplained_rms", "gain", "delay_s", "lag_s", "natural_hz",
    "damping", "deviation", "correlation_s",
)  # fmt: skip


@dataclass(frozen=True, kw_only=True)
class IdentifyOptions:
    """What the command line asked for: `files` are commands and motion of each robot in turn.

    `offset_s` is added to the times of commands; `heading_axis` is the axis of the tracked bodies that points ahead,
    None for one that lies level; `summary` and `source` are what the plant file says of itself.
    """

    files: tuple[Path, ...]
    offset_s: float
    heading_axis: str | None = None
    summary: str
    source: str
    plant: Path | None
    profile: Path | None
    out: Path | None


@dataclass(frozen=True)
class MeasuredAxis:
    """One axis of one robot: its spectra, and what was fitted to them."""

    name: str
    spectra: CrossSpectra
    identified: IdentifiedAxis


def identify(options: IdentifyOptions, console: Console) -> None:
    """Measure, print and, where asked, write; raises MtmError when a file cannot be used."""
    if not options.files or len(options.files) % 2:
        raise MtmError("name two files for each robot: its commands, then how it moved")
    runs: list[tuple[str, list[MeasuredAxis]]] = []
    for commands, truth in zip(options.files[::2], options.files[1::2], strict=True):
        run = logged_run(read_commands(commands, options.offset_s), read_truth(truth, options.heading_axis), RATE_HZ)
        runs.append((commands.stem, measured_axes(run, commands)))
    console.print(_table(runs))
    _mention_feedback(runs)
    command = _command(options)
    if options.plant is not None:
        save_plant(_plant(runs, options), options.plant, [*provenance(command), *_figures(runs)])
        print(f"wrote {options.plant}; use it with mtm-hil bench --plants {options.plant}")
    if options.profile is not None:
        _write_profile([axis for _, axes in runs for axis in axes], options.profile)
    if options.out is not None:
        write_result_csv(options.out, command, _COLUMNS, [_row(name, axis) for name, axes in runs for axis in axes])
        print(f"wrote {options.out}")


def _mention_feedback(runs: Sequence[tuple[str, Sequence[MeasuredAxis]]]) -> None:
    for name, axes in runs:
        for axis in axes:
            if phase_delay_s(axis.spectra) < 0.0:
                print(
                    f"{name}, {axis.name}: the motion comes before its commands, so that these answer it, as those of "
                    "a held heading do, or the clocks differ; do not use this axis"
                )


def measured_axes(run: LoggedRun, commands: Path) -> list[MeasuredAxis]:
    """The axes that were commanded; raises MtmError when none was, or the run is too short."""
    found = []
    for place, name in enumerate(AXES):
        if np.std(run.commanded[:, place]) < _LEAST_COMMAND:
            continue
        spectra = cross_spectra([run], place)
        noise = fit_interference(spectra)
        found.append(
            MeasuredAxis(name, spectra, IdentifiedAxis(fit_response(spectra), noise.deviation, noise.correlation_s))
        )
    if not found:
        raise MtmError(f"{commands}: the commands never change, so nothing can be learnt from them; name another log")
    return found


def _plant(runs: Sequence[tuple[str, Sequence[MeasuredAxis]]], options: IdentifyOptions) -> IdentifiedPlant:
    robots = [IdentifiedRobot(name, {axis.name: axis.identified for axis in axes}) for name, axes in runs]
    if len({frozenset(robot.axes) for robot in robots}) > 1:
        raise MtmError("the robots were commanded on different axes; identify each kind by itself")
    return IdentifiedPlant(options.summary, options.source, tuple(robots))


def _write_profile(axes: Sequence[MeasuredAxis], path: Path) -> None:
    responses = [axis.identified.response for axis in axes]
    profile = profile_of(responses)
    if profile is None:
        worst = max(float(missed(response).min()) for response in responses)
        print(f"no profile: the plants that decode knows miss {100 * worst:.0f} % of a response, and at most "
              f"{100 * MOST_MISSED:.0f} % would do")  # fmt: skip
        return
    by_name = {name: [axis for axis in axes if axis.name == name] for name in AXES}
    known = tuple(
        axis_response(name, [axis.identified.response for axis in own], [axis.spectra for axis in own])
        for name, own in by_name.items() if own
    )  # fmt: skip
    save_profile(replace(profile, axes=known), path, "mtm-hil identify")
    print(f"wrote {path}; use it with mtm-audit decode --profile {path}, and with mtm-audit plan")


def _figures(runs: Sequence[tuple[str, Sequence[MeasuredAxis]]]) -> list[str]:
    """What was measured, a line for each axis, over all robots."""
    lines = []
    for name in AXES:
        axes = [axis for _, own in runs for axis in own if axis.name == name]
        if not axes:
            continue
        gains = np.median([np.abs(_at(axis.spectra, axis.spectra.gain)) for axis in axes], axis=0)
        coherence = np.median([_at(axis.spectra, axis.spectra.coherence) for axis in axes], axis=0)
        delays = [phase_delay_s(axis.spectra) for axis in axes]
        rests = [axis.spectra.unexplained_rms(*BAND_HZ) for axis in axes]
        lines.append(
            f"{name}: at {', '.join(f'{hz:g}' for hz in SHOWN_HZ)} Hz gain {_listed(gains)}, coherence "
            f"{_listed(coherence)} (medians of {len(axes)}); delay by the phase {np.nanmin(delays):.2f} to "
            f"{np.nanmax(delays):.2f} s; unexplained in {BAND_HZ[0]:g}-{BAND_HZ[1]:g} Hz {min(rests):.3g} to "
            f"{max(rests):.3g} {'rad/s' if name == 'wz' else 'm/s'} rms"
        )
    return lines


def _listed(values: Sequence[float]) -> str:
    return " ".join(f"{value:.2f}" for value in values)


def _at(spectra: CrossSpectra, values: np.ndarray) -> np.ndarray:
    return values[[int(np.argmin(np.abs(spectra.frequencies_hz - hz))) for hz in SHOWN_HZ]]


def _table(runs: Sequence[tuple[str, Sequence[MeasuredAxis]]]) -> Table:
    table = Table(
        title="gain (coherence) of each axis, and what fits it", box=None, padding=(0, 1, 0, 0), pad_edge=False
    )
    for name in ("run", "axis", *(f"{hz:g} Hz" for hz in SHOWN_HZ), "delay by phase", "unexplained", "fit"):
        table.add_column(name, no_wrap=True)
    for name, axes in runs:
        for axis in axes:
            spectra, response = axis.spectra, axis.identified.response
            shares = zip(np.abs(_at(spectra, spectra.gain)), _at(spectra, spectra.coherence), strict=True)
            follows = f"lag {response.lag_s:.2f} s" if response.natural_hz is None else (
                f"{response.natural_hz:.2f} Hz, damping {response.damping:.2f}")  # fmt: skip
            table.add_row(
                name, axis.name, *(f"{gain:.2f} ({coherence:.2f})" for gain, coherence in shares),
                f"{phase_delay_s(spectra):.2f} s", f"{spectra.unexplained_rms(*BAND_HZ):.4f}",
                f"gain {response.gain:.2f}, delay {response.delay_s:.2f} s, {follows}",
            )  # fmt: skip
    return table


def _row(run: str, axis: MeasuredAxis) -> tuple[object, ...]:
    spectra, own = axis.spectra, axis.identified
    response = own.response
    natural_hz, damping = ("", "") if response.natural_hz is None else (response.natural_hz, response.damping)
    values = (
        phase_delay_s(spectra), *np.abs(_at(spectra, spectra.gain)), *_at(spectra, spectra.coherence),
        spectra.unexplained_rms(*BAND_HZ), response.gain, response.delay_s, response.lag_s, natural_hz, damping,
        own.deviation, own.correlation_s,
    )  # fmt: skip
    return (run, axis.name, spectra.segments, *(v if isinstance(v, str) else f"{v:.4g}" for v in values))


def _command(options: IdentifyOptions) -> str:
    names = " ".join(path.name for path in options.files)
    offset = f" --offset {options.offset_s:g}" if options.offset_s else ""
    axis = f" --heading-axis {options.heading_axis}" if options.heading_axis is not None else ""
    return f"mtm-hil identify {names}{offset}{axis}"
