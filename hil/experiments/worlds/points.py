"""The points of the paper's design space (Section "Design Space") that are measured in the simulated worlds.

What the paper reports for them is in paper_worlds.csv, from its appendices' tables tab:discovery-single-x to
tab:football-indep.
"""

import csv
from collections.abc import Mapping
from dataclasses import asdict, dataclass, fields, replace
from functools import cache
from pathlib import Path

from hil.experiments.runs.cells import Scalar, Values
from hil.worlds.schemes import same_scheme, single_scheme, split_scheme
from mtm_onboard.protocol import Scheme

SAME, SPLIT = "same", "split"
_PAPER_CSV = Path(__file__).with_name("paper_worlds.csv")


@dataclass(frozen=True, kw_only=True)
class Point:
    """A scheme in a world and how many goals a rollout pursues under it.

    `arrangement` is the name of the channel that carries the message, "same" or "split"; `symbols` is l_c of each
    channel used, as text joined by "+". A message is one goal, or all of a rollout's goals when `whole` is set.
    """

    world: str
    arrangement: str
    alphabet_size: int
    message_ticks: int
    symbols: str
    goals: int
    whole: bool = False

    @property
    def scheme(self) -> Scheme:
        """The scheme of its messages."""
        counts = tuple(int(count) for count in self.symbols.split("+"))
        if self.arrangement == SPLIT:
            return split_scheme(self.world, self.alphabet_size, self.message_ticks, counts)
        if self.arrangement == SAME:
            return same_scheme(self.world, self.alphabet_size, self.message_ticks, counts[0])
        return single_scheme(self.world, self.arrangement, self.alphabet_size, self.message_ticks, counts[0])

    @property
    def messages(self) -> int:
        """Messages in a rollout."""
        return 1 if self.whole else self.goals

    @property
    def goal_ticks(self) -> int:
        """Ticks for which each goal is pursued."""
        return self.message_ticks * self.messages // self.goals

    @property
    def goal_symbols(self) -> int:
        """Consecutive symbols that spell one goal."""
        return self.scheme.message_symbols * self.messages // self.goals

    def of_arrangement(self, arrangement: str) -> "Point":
        """The same messages on the channel of that name."""
        return replace(self, arrangement=arrangement)

    def parameters(self) -> dict[str, Scalar]:
        """For a cell."""
        return asdict(self)


def point_of(parameters: Values) -> Point:
    """The point among a cell's parameters."""
    names = {field.name for field in fields(Point)}
    return Point(**{name: value for name, value in parameters.items() if name in names})  # type: ignore[arg-type]


@dataclass(frozen=True)
class PaperEntry:
    """A table entry of the paper: percent of messages right, its standard error (NaN where not given), margin."""

    point: Point
    percent: float
    error: float
    margin: float


@cache
def paper_entries(world: str) -> tuple[PaperEntry, ...]:
    """All entries of the world's tables, in the paper's order."""
    with _PAPER_CSV.open(encoding="utf-8", newline="") as file:
        rows = list(csv.DictReader(line for line in file if not line.startswith("#")))
    return tuple(_paper_entry(row) for row in rows if row["world"] == world)


def _paper_entry(row: Mapping[str, str]) -> PaperEntry:
    point = Point(
        world=row["world"],
        arrangement=row["arrangement"],
        alphabet_size=int(row["alphabet_size"]),
        message_ticks=int(row["message_ticks"]),
        symbols=row["symbols"],
        goals=int(row["goals"]),
        whole=row["whole"] == "yes",
    )
    return PaperEntry(point, float(row["percent"]), float(row["error"] or "nan"), float(row["margin"] or "nan"))


@dataclass(frozen=True)
class Headline:
    """The paper's best-known point of a world, and shorter messages at which detectors are compared."""

    arrangement: str
    alphabet_size: int
    message_ticks: int
    shorter_ticks: tuple[int, ...]


# The shorter ones are a half, a third and less, as even windows allow.
HEADLINES: dict[str, Headline] = {
    "discovery": Headline(SAME, 8, 108, (24, 30, 36, 48, 54, 60, 72, 84)),
    "lunar-lander": Headline(SAME, 8, 288, (48, 72, 96, 120, 144, 192)),
    "reacher": Headline("inner", 8, 240, (40, 60, 80, 96, 120, 168)),
    "football": Headline(SAME, 64, 516, (96, 128, 172, 258, 344)),
}


def headline_point(world: str, ticks: int | None = None) -> Point:
    """The headline point, or the same scheme with shorter messages; one symbol is a goal in all of them."""
    headline = HEADLINES[world]
    goals = 1 if world == "football" else 8
    return Point(
        world=world,
        arrangement=headline.arrangement,
        alphabet_size=headline.alphabet_size,
        message_ticks=ticks or headline.message_ticks,
        symbols="1",
        goals=goals,
    )
