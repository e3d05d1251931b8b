"""How often the paper's job is decoded: four robots, M = 4, one symbol each, motion capture of the calibrated chassis.

The robots move for 1.5 s, then send, and the recording ends 0.6 s after the message or its last repetition. One cell is
one rollout; conditions share their seeds.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from hil.experiments.runs.cells import Cell, Scalar, Values
from hil.experiments.verdicts.thresholds import THRESHOLDS, decode_at
from hil.fleet.lockstep import run_lockstep
from hil.fleet.recording import motion_capture_tracks
from hil.fleet.rig import RunSettings
from hil.plants.mecanum import MecanumParameters, calibrated_parameters
from hil.sensors.motion_capture import MotionCapture
from hil.worlds.robomaster import ROBOTS, fleet_scheme
from mtm_audit.decoding.settings import DecodeSettings
from mtm_onboard.protocol import Key

_STREAM = 704
_START_S, _AFTER_S = 1.5, 0.6
_ALPHABET = 4


@dataclass(frozen=True)
class Condition:
    """How the message is sent and decoded: how often, whether its start is known, and whether by a slower chassis than
    the calibrated one; `ticks` are the message lengths to try, in ascending order.
    """

    name: str
    messages: int
    onset_known: bool
    slower: bool
    ticks: tuple[int, ...]


CONDITIONS = (
    Condition("once, onset known", 1, True, False, (100, 150, 200, 300, 600)),
    Condition("once, onset unknown", 1, False, False, (100, 150, 200, 300, 600)),
    Condition("twice, onset known", 2, True, False, (150,)),
    Condition("twice, onset known, slower chassis", 2, True, True, (150,)),
)


@dataclass(frozen=True, kw_only=True)
class PowerSummary:
    """One condition, message length and threshold, in rollouts: `likeliest` are those whose likeliest symbols are the
    message's, `likeliest_absent` those of them that are absent.
    """

    condition: str
    ticks: int
    threshold: float
    rollouts: int
    decoded: int
    wrong: int
    inconclusive: int
    absent: int
    likeliest: int
    likeliest_absent: int


def power_cells(condition: Condition, ticks: int, rollouts: int, first_seed: int) -> list[Cell]:
    """One cell for each rollout."""
    parameters: Values = {"condition": condition.name, "ticks": ticks}
    return [Cell("power of verdicts", parameters, first_seed + row) for row in range(rollouts)]


def decode_job(parameters: Values, seed: int) -> dict[str, Scalar]:
    """Run and decode one rollout: the verdict at each threshold, and whether it and the likeliest symbols are right."""
    condition = next(item for item in CONDITIONS if item.name == parameters["condition"])
    draw = np.random.default_rng([_STREAM, seed])
    scheme = fleet_scheme(int(parameters["ticks"]))
    key = Key("sent", draw.bytes(32), scheme)
    symbols = tuple(int(symbol) for symbol in draw.integers(0, _ALPHABET, ROBOTS))
    seconds = _START_S + condition.messages * scheme.message_ticks / scheme.rate_hz + _AFTER_S
    plant = slower_parameters() if condition.slower else calibrated_parameters()
    settings = RunSettings(
        key=key, symbols=symbols, seconds=seconds, seed=seed, wire="direct", start_s=_START_S, plant=plant
    )
    tracks = motion_capture_tracks(run_lockstep(settings), seed, MotionCapture())
    asked = DecodeSettings(onset_s=_START_S if condition.onset_known else None)
    decodings = decode_at(tracks, key, asked)
    result: dict[str, Scalar] = {"likeliest_right": decodings[-1].symbols == symbols}
    for threshold, decoding in zip(THRESHOLDS, decodings, strict=True):
        result[f"verdict {threshold:g}"] = decoding.verdict
        result[f"right {threshold:g}"] = decoding.symbols == symbols
    return result


def slower_parameters() -> MecanumParameters:
    """A chassis with twice the lag and the delay of the calibrated one, and slip that is slower by as much."""
    usual = calibrated_parameters()
    return replace(
        usual,
        lag_s=2.0 * usual.lag_s,
        delay_s=2.0 * usual.delay_s,
        slip_correlation_s=2.0 * usual.slip_correlation_s,
    )


def summarise_power(condition: Condition, ticks: int, results: Sequence[Values]) -> list[PowerSummary]:
    """Collect the rollouts of a condition and a message length, at each threshold."""
    summaries = []
    for threshold in THRESHOLDS:
        verdicts = [str(result[f"verdict {threshold:g}"]) for result in results]
        right = [bool(result[f"right {threshold:g}"]) for result in results]
        likeliest = [bool(result["likeliest_right"]) for result in results]
        summaries.append(
            PowerSummary(
                condition=condition.name,
                ticks=ticks,
                threshold=threshold,
                rollouts=len(results),
                decoded=verdicts.count("decoded"),
                wrong=sum(name == "decoded" and not sure for name, sure in zip(verdicts, right, strict=True)),
                inconclusive=verdicts.count("inconclusive"),
                absent=verdicts.count("absent"),
                likeliest=sum(likeliest),
                likeliest_absent=sum(name == "absent" and hit for name, hit in zip(verdicts, likeliest, strict=True)),
            )
        )
    return summaries


def smallest_decoded(summaries: Sequence[PowerSummary], condition: str, threshold: float) -> int | None:
    """The smallest message length at which and above which most rollouts are decoded; None when it was not tried."""
    smallest = None
    ours = [item for item in summaries if (item.condition, item.threshold) == (condition, threshold)]
    for summary in sorted(ours, key=lambda item: -item.ticks):
        if 2 * summary.decoded <= summary.rollouts:
            break
        smallest = summary.ticks
    return smallest
