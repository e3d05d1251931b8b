"""Accuracy tables of simulated worlds, as `mtm-audit plan` reads them: a_c(t, M) of the paper's "Design Space"."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial

from rich.console import Console

from hil.experiments.detectors.accuracy_rollout import WHOLE, read_rollout, rollout_parameters
from hil.experiments.runs.cells import Cell, CellStore, Scalar, Values
from hil.experiments.runs.proportion import Proportion
from hil.experiments.runs.sweep import Compute, run_sweep
from hil.experiments.worlds.accuracy import read_world, world_parameters, world_scheme
from hil.plants.mecanum import calibrated_parameters
from hil.worlds.registry import NAMES
from hil.worlds.robomaster import fleet_scheme
from mtm_audit.planning.table import AccuracyPoint, AccuracyTable, members_of
from mtm_onboard.protocol import Scheme
from mtm_onboard.protocol.errors import WrongValueError


@dataclass(frozen=True)
class World:
    """What a sweep needs of a world: a scheme of M, t and a number of equal windows, and how a rollout of it is read.

    `compute` gets what `parameters` makes of scheme and detector, and gives the symbols right by channel name, pooled
    ones included, and whether the `WHOLE` message was.
    """

    scheme: Callable[[int, int, int], Scheme]
    parameters: Callable[[Scheme, str], Mapping[str, Scalar]]
    compute: Compute


def _robomaster_scheme(alphabet_size: int, window_ticks: int, windows: int) -> Scheme:
    paper = fleet_scheme(window_ticks * windows)
    channels = tuple(replace(channel, symbols=windows) for channel in paper.channels)
    return replace(paper, alphabet_size=alphabet_size, channels=channels)


WORLDS: dict[str, World] = {
    "robomaster": World(
        _robomaster_scheme,
        lambda scheme, detector: rollout_parameters(scheme, detector, calibrated_parameters()),
        read_rollout,
    ),
    **{name: World(partial(world_scheme, name), partial(world_parameters, name), read_world) for name in NAMES},
}


@dataclass(frozen=True)
class Sweep:
    """What to measure: which schemes, with which detector, in how many rollouts from which seed on."""

    world: str
    schemes: tuple[Scheme, ...]
    detector: str
    rollouts: int
    first_seed: int


def world_of(name: str) -> World:
    """The world of that name; raises MtmError that lists them."""
    if name not in WORLDS:
        raise WrongValueError(f"there is no world {name!r}; choose one of: {', '.join(WORLDS)}")
    return WORLDS[name]


def grid(world: str, alphabet_sizes: Sequence[int], window_ticks: Sequence[int], windows: int) -> tuple[Scheme, ...]:
    """One scheme for each M and t, with so many windows in a row; raises MtmError when one cannot be played.

    A detector that learns from all windows of a recording is the more accurate the more there are, so `windows` should
    be about what a channel will send in one message.
    """
    make = world_of(world).scheme
    return tuple(
        make(alphabet, ticks, windows)
        for alphabet in dict.fromkeys(alphabet_sizes)
        for ticks in dict.fromkeys(window_ticks)
    )


def measure(
    sweep: Sweep, store: CellStore, console: Console, workers: int | None = None
) -> tuple[AccuracyTable, tuple[Proportion, ...]]:
    """The table of all channels under all schemes, and the share of whole messages of each scheme.

    Rollouts of different schemes take different seeds, so that points are independent of each other.
    """
    world = world_of(sweep.world)
    groups = [
        [Cell("sweep", {"world": sweep.world, **parameters}, sweep.first_seed + number * sweep.rollouts + rollout)
         for rollout in range(sweep.rollouts)]
        for number, parameters in enumerate(world.parameters(scheme, sweep.detector) for scheme in sweep.schemes)
    ]  # fmt: skip
    results = iter(run_sweep(world.compute, [cell for group in groups for cell in group], store, console, workers))
    points: list[AccuracyPoint] = []
    messages: list[Proportion] = []
    for scheme in sweep.schemes:
        own = [next(results) for _ in range(sweep.rollouts)]
        points += _points(scheme, own)
        messages.append(Proportion(sum(int(result[WHOLE]) for result in own), len(own)))
    return AccuracyTable(tuple(points)), tuple(messages)


def _points(scheme: Scheme, results: Sequence[Values]) -> list[AccuracyPoint]:
    points = []
    for name in (name for name in results[0] if name != WHOLE):
        channel = scheme.channel(members_of(name)[0])
        right = sum(int(result[name]) for result in results)
        points.append(
            AccuracyPoint(
                name, scheme.alphabet_size, scheme.window_ticks(channel), right, channel.symbols * len(results)
            )
        )
    return points
