"""The fault matrix: every fault of every wire, with the link kept and with the link lost, from end to end.

Requirements: the robot stands still `STALE_S` after the last base command whatever the wire does, and, after the link
is lost, within the deadman time of the robot at its far end where it has one. `GRACE_S` is one tick and two polls of
the wire; a wire that loses, delays or corrupts messages may take `LATE_S` longer, since a stop is a message too.
"""

import math
import tempfile
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from hil.experiments.hardening.fault_run import (
    DEADMEN_S,
    END_S,
    FOUND_S,
    LOST_S,
    SILENT_S,
    START_S,
    Fault,
    FaultRun,
    run_fault,
)
from hil.experiments.runs.cells import Cell, Scalar, Values
from hil.fleet.rig import SAMPLE_PERIOD_S
from hil.sensors.motion_capture import MotionCapture, capture
from hil.sensors.poses import Trajectory
from hil.wires.faulty_wire import WireFaults
from hil.worlds.robomaster import fleet_scheme
from mtm_audit.decoding.decode import decode_tracks
from mtm_audit.decoding.settings import DecodeSettings
from mtm_onboard.model.velocity import STOP
from mtm_onboard.protocol import Channel, Key
from mtm_onboard.protocol.journal_file import NOISE, UNSENT, JournalRecord
from mtm_onboard.runtime.guard import Staleness

WIRES = tuple(DEADMEN_S)
LOSSES = ("", "cut", "swallowed")
FAULTS = {
    "none": Fault(),
    "drop": Fault(WireFaults(drop=0.1)),
    "delay": Fault(WireFaults(delay_s=(0.02, 0.1))),
    "duplicate": Fault(WireFaults(duplicate=0.1)),
    "corrupt": Fault(WireFaults(corrupt=0.05)),
    "reorder": Fault(WireFaults(reorder=0.1)),
    "quantise": Fault(grain=0.05),
    "saturate": Fault(most=0.25),
    "block": Fault(WireFaults(block_s=0.06)),
}
STALE_S = Staleness().stopped_s
GRACE_S = 0.04
LATE_S = 0.1

_SYMBOLS = (3, 1)
_WINDOW_TICKS = 200
_SAME = 2e-4  # above what plaintext rounds off, in m/s and rad/s
_MOSTLY = 0.75
_WRONG_AT_MOST = 0.01


@dataclass(frozen=True, kw_only=True)
class Outcome:
    """The measurements of one run; ages and times in seconds.

    `altered`: commands that came into force but were never sent. `arrived_s`: greatest age of a command when it came
    into force; `held_s`: greatest age of a command while in force. `lost_stop_s`: from the loss of the link to the
    stop, -1 when the robot did not stop before the wire was restored and 0 without a loss. `silent_stop_s`: from the
    last base command to the last stop. `windows`: windows of the message; `sent`: those of which the runtime sent at
    least three quarters of the ticks within what the robot can do. `message_is_due`: these hold every symbol;
    `is_decoded`: the message was decoded correctly.
    """

    altered: int
    arrived_s: float
    held_s: float
    lost_stop_s: float
    silent_stop_s: float
    losses: int
    windows: int
    sent: int
    message_is_due: bool
    is_decoded: bool
    p_value: float


@dataclass(frozen=True, kw_only=True)
class Row:
    """One row of the matrix: an outcome and its deadlines; `lost_deadline_s` None for a robot without a deadman."""

    wire: str
    fault: str
    loss: str
    seed: int
    outcome: Outcome
    silent_deadline_s: float
    lost_deadline_s: float | None

    @property
    def stops(self) -> bool:
        """Whether the robot stood still by every deadline."""
        outcome = self.outcome
        in_time = outcome.silent_stop_s <= self.silent_deadline_s
        if self.loss and self.lost_deadline_s is not None:
            in_time = in_time and 0.0 <= outcome.lost_stop_s <= self.lost_deadline_s
        return in_time

    @property
    def is_fresh(self) -> bool:
        """Whether no command was stale when it came into force."""
        return self.outcome.arrived_s <= STALE_S

    @property
    def is_read(self) -> bool:
        """Whether the message was decoded, or was not sent whole."""
        return self.outcome.is_decoded or not self.outcome.message_is_due


def fault_cells(seeds: int, first_seed: int, wires: Sequence[str] = WIRES) -> list[Cell]:
    """A cell for each combination of wire, fault, loss and seed."""
    return [
        Cell("faults", {"wire": wire, "fault": fault, "loss": loss}, first_seed + number)
        for wire in wires
        for fault in FAULTS
        for loss in LOSSES
        for number in range(seeds)
    ]


def fault_cell(parameters: Values, seed: int) -> dict[str, Scalar]:
    """The fields of the `Outcome` of one cell: run it and decode its motion."""
    draw = np.random.default_rng([17, seed])
    fleet = fleet_scheme(len(_SYMBOLS) * _WINDOW_TICKS)
    scheme = replace(fleet, channels=(Channel("robot0", "robot0", ("vx", "vy"), len(_SYMBOLS), 0.1),))
    key = Key("faults", draw.bytes(32), scheme)
    with tempfile.TemporaryDirectory() as folder:
        run = run_fault(
            str(parameters["wire"]), FAULTS[str(parameters["fault"])], str(parameters["loss"]), key, _SYMBOLS,
            seed=seed, folder=Path(folder),
        )  # fmt: skip
    return assess(run, bool(parameters["loss"]), FAULTS[str(parameters["fault"])].most) | _decoded(run, key, draw)


def row_of(cell: Cell, result: Values) -> Row:
    """The row of a finished cell."""
    wire, fault, loss = (str(cell.parameters[name]) for name in ("wire", "fault", "loss"))
    late_s = LATE_S if FAULTS[fault].wire != WireFaults() else 0.0
    deadman_s = DEADMEN_S[wire]
    outcome = Outcome(**result)  # type: ignore[arg-type]
    return Row(
        wire=wire,
        fault=fault,
        loss=loss,
        seed=cell.seed,
        outcome=outcome,
        silent_deadline_s=STALE_S + GRACE_S + late_s,
        lost_deadline_s=None if deadman_s is None else deadman_s + GRACE_S + late_s,
    )


def assess(run: FaultRun, is_lost: bool, most: float = np.inf) -> dict[str, Scalar]:
    """The fields of an `Outcome` that compare the robot's motion with the journal; `most` limits the robot's axes."""
    altered, arrived_s, held_s = 0, 0.0, 0.0
    ends_s = [when_s for when_s, _ in run.in_force[1:]] + [END_S]
    for (when_s, velocity), end_s in zip(run.in_force, ends_s, strict=True):
        if velocity == STOP:
            continue
        sent_s = _sent_s(run.journal, np.array(velocity), when_s)
        if sent_s is None:
            altered, sent_s = altered + 1, when_s
        arrived_s, held_s = max(arrived_s, when_s - sent_s), max(held_s, end_s - sent_s)
    stops_s = [when_s for when_s, velocity in run.in_force if velocity == STOP and LOST_S <= when_s < FOUND_S]
    lost_stop_s = (stops_s[0] - LOST_S if stops_s else -1.0) if is_lost else 0.0
    moved_s = max(end_s for (_, velocity), end_s in zip(run.in_force, ends_s, strict=True) if velocity != STOP)
    rate_hz = run.journal.header.rate_hz
    last_base_s = START_S + math.ceil((SILENT_S - START_S) * rate_hz - 1e-6) / rate_hz - 1.0 / rate_hz
    sent = _windows_sent(run.journal, most)
    return {
        "altered": altered, "arrived_s": round(arrived_s, 4), "held_s": round(held_s, 4),
        "lost_stop_s": round(lost_stop_s, 4), "silent_stop_s": round(moved_s - last_base_s, 4), "losses": run.losses,
        "windows": len(sent), "sent": sum(sent),
        "message_is_due": all(any(sent[place :: len(_SYMBOLS)]) for place in range(len(_SYMBOLS))),
    }  # fmt: skip


def _sent_s(journal: JournalRecord, velocity: np.ndarray, by_s: float) -> float | None:
    """When that command was last sent before `by_s`; None when it never was."""
    times_s = START_S + journal.ticks / journal.header.rate_hz
    same = np.all(np.abs(journal.sent - velocity) < _SAME, axis=1) & (times_s <= by_s + 1e-9)
    return float(times_s[same][-1]) if np.any(same) else None


def _windows_sent(journal: JournalRecord, most: float) -> list[bool]:
    """For each window until the base commands end, whether most of it was sent and is within the robot's limits."""
    count = int((SILENT_S - START_S) * journal.header.rate_hz) // _WINDOW_TICKS
    left = np.zeros(count * _WINDOW_TICKS, dtype=np.bool_)
    with_noise = ((journal.flags & (NOISE | UNSENT)) == NOISE) & np.all(np.abs(journal.sent) <= most, axis=1)
    ticks = journal.ticks[with_noise]
    left[ticks[(ticks >= 0) & (ticks < len(left))]] = True
    return [bool(share >= _MOSTLY) for share in left.reshape(count, _WINDOW_TICKS).mean(axis=1)]


def _decoded(run: FaultRun, key: Key, draw: np.random.Generator) -> dict[str, Scalar]:
    times_s = np.arange(len(run.motion), dtype=np.float64) * SAMPLE_PERIOD_S
    trajectory = Trajectory("robot0", times_s, run.motion[:, :2], run.motion[:, 2])
    tracks = capture(MotionCapture(), [trajectory], draw, end_s=SILENT_S)
    # Half of the windows may be missing; whether the rest came through is no question of one wrong answer in 10,000.
    decoding = decode_tracks(tracks, key, DecodeSettings(onset_s=START_S, threshold=_WRONG_AT_MOST))
    is_decoded = decoding.verdict == "decoded" and decoding.symbols == _SYMBOLS
    return {"is_decoded": is_decoded, "p_value": decoding.evidence.p_value}
