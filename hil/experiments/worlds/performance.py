"""What the noise costs the task: the paper's appendix "Task Performance Preservation" (tab:reward-impact).

Beside the paper's measures: energy, jerk, and how often a command is at its limit.
"""

import json
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from rich.console import Console
from rich.table import Table

from hil.experiments.runs.cells import Cell, CellStore, Scalar, Values
from hil.experiments.runs.result_file import write_result_csv
from hil.experiments.runs.sweep import run_sweep
from hil.experiments.worlds.points import SAME, headline_point
from hil.worlds.noise import keyed_noise, white_noise
from hil.worlds.registry import make_world
from hil.worlds.world import ControlHistory
from mtm_audit.model.track import Floats
from mtm_onboard.protocol import Codebook

CLEAN, WHITE, KEYED = "clean", "white noise", "watermarked"
# tab:reward-impact: mean and standard deviation.
PAPER: dict[tuple[str, str], dict[str, str]] = {
    ("discovery", "final distance to goal, m"): {
        CLEAN: "0.2404±0.0479", WHITE: "0.2420±0.0499", KEYED: "0.2403±0.0481",
    },
    ("lunar-lander", "episodic return"): {CLEAN: "265.8±85.2", WHITE: "254.8±100.9", KEYED: "253.8±101.6"},
    ("reacher", "50-step return"): {WHITE: "-4.31±1.21", KEYED: "-4.15±1.23"},
    ("football", "mean distance of the ball to the goal, m"): {
        CLEAN: "0.818±0.177", WHITE: "0.984±0.252", KEYED: "0.917±0.227",
    },
    ("football", "scored"): {CLEAN: "1.00", WHITE: "0.88", KEYED: "0.90"},
}  # fmt: skip
# How many times the command is integrated until it is a position: jerk is its derivative of the order 3 - n.
_INTEGRATIONS = {"discovery": 1, "lunar-lander": 2, "reacher": 2, "football": 2}
_BATCH = {"discovery": 50, "lunar-lander": 10, "reacher": 25, "football": 25}
_KEYS_STREAM, _NOISE_STREAM = 7, 8


@dataclass(frozen=True)
class Measure:
    """Mean and standard deviation of one measure over the rollouts of one condition."""

    world: str
    condition: str
    name: str
    rollouts: int
    mean: float
    deviation: float

    @property
    def paper(self) -> str:
        """What the paper reports for it, as text; nothing where it does not."""
        return PAPER.get((self.world, self.name), {}).get(self.condition, "")


def conditions_of(world: str) -> tuple[str, ...]:
    """The conditions of a world; a stochastic policy has no clean controller."""
    return (WHITE, KEYED) if world == "reacher" else (CLEAN, WHITE, KEYED)


def perform_batch(parameters: Values, seed: int) -> dict[str, Scalar]:
    """Measures by name, each a JSON list with a number for each rollout, of `seed` and the seeds after it."""
    name, condition, batch = str(parameters["world"]), str(parameters["condition"]), int(parameters["batch"])
    world = make_world(name)
    seeds = range(seed, seed + batch)
    noise = np.stack([_noise(name, condition, world.axes, world.task_ticks, own) for own in seeds])
    results: dict[str, list[float]] = {}
    for control in world.perform(noise, seeds):
        for measure, value in measures(name, control, world.rate_hz).items():
            results.setdefault(measure, []).append(value)
    return {measure: json.dumps(values) for measure, values in results.items()}


def measures(world: str, control: ControlHistory, rate_hz: float) -> dict[str, float]:
    """The task's own scores, and of the commands: mean square, root mean square jerk, share at the limit.

    Commands are in units of the world's action, so jerk is in that unit per second to the power of how many
    derivatives lie between (one of a force, two of a velocity).
    """
    sent = control.applied
    jerks = np.diff(sent, n=3 - _INTEGRATIONS[world], axis=0) * rate_hz ** (3 - _INTEGRATIONS[world])
    limited = (np.abs(control.requested - sent) > 1e-6) & (np.abs(sent) > 0.99)
    return {
        **control.scores,
        "energy, mean square command": float(np.mean(np.sum(sent**2, axis=1))),
        "jerk, root mean square": float(np.sqrt(np.mean(jerks**2))),
        "commands at the limit": float(np.mean(limited)),
    }


def measure(
    worlds: Sequence[str], rollouts: int, first_seed: int, store: CellStore, console: Console, workers: int | None
) -> list[Measure]:
    """All measures under all conditions, with the same seeds under each."""
    cells = [
        (world, condition, _cell(world, condition, first_seed + first, min(_BATCH[world], rollouts - first)))
        for world in worlds
        for condition in conditions_of(world)
        for first in range(0, rollouts, _BATCH[world])
    ]
    results = run_sweep(perform_batch, [cell for *_, cell in cells], store, console, workers)
    gathered: dict[tuple[str, str, str], list[float]] = {}
    for (world, condition, _), result in zip(cells, results, strict=True):
        for name, values in result.items():
            gathered.setdefault((world, condition, name), []).extend(json.loads(str(values)))
    return [
        Measure(*key, len(values), float(np.mean(values)), float(np.std(values, ddof=1)) if len(values) > 1 else 0.0)
        for key, values in gathered.items()
    ]


def _cell(world: str, condition: str, seed: int, batch: int) -> Cell:
    return Cell("performance", {"world": world, "condition": condition, "batch": batch}, seed)


def _noise(world: str, condition: str, axes: Sequence[str], ticks: int, seed: int) -> Floats:
    # On all axes at once, which costs the task the most.
    scheme = headline_point(world).of_arrangement(SAME).scheme
    if condition == CLEAN:
        return np.zeros((ticks, len(axes)))
    if condition == WHITE:
        return white_noise(scheme, ticks, axes, np.random.default_rng([_NOISE_STREAM, seed]))
    generator = np.random.default_rng([_KEYS_STREAM, seed])
    codebook = Codebook(generator.bytes(32), scheme)
    count = -(-ticks // scheme.message_ticks)
    messages = generator.integers(scheme.alphabet_size, size=(count, scheme.message_symbols)).tolist()
    return keyed_noise(codebook, messages, axes)[:ticks]


def rich_table(rows: Sequence[Measure]) -> Table:
    """One line for each measure, the conditions side by side, ours and the paper's."""
    table = Table(title=f"Task performance, {rows[0].rollouts} rollouts: mean±standard deviation (paper)", box=None,
                  padding=(0, 1, 0, 0), pad_edge=False)  # fmt: skip
    for name in ("world", "measure", CLEAN, WHITE, KEYED):
        table.add_column(name, justify="left" if name in ("world", "measure") else "right")
    for world, name in dict.fromkeys((row.world, row.name) for row in rows):
        own = {row.condition: row for row in rows if (row.world, row.name) == (world, name)}
        table.add_row(world, name, *(_text_of(own.get(condition)) for condition in (CLEAN, WHITE, KEYED)))
    return table


def _text_of(row: Measure | None) -> str:
    if row is None:
        return ""
    return f"{row.mean:.4g}±{row.deviation:.3g}" + (f" ({row.paper})" if row.paper else "")


def write_csv(path: Path, rows: Sequence[Measure], command: str) -> None:
    """Write the rows under the command line."""
    columns = ("world", "measure", "condition", "rollouts", "mean", "standard_deviation", "paper")
    lines = [
        (row.world, row.name, row.condition, row.rollouts, f"{row.mean:.5g}", f"{row.deviation:.4g}", row.paper)
        for row in rows
    ]
    write_result_csv(path, command, columns, lines)
