"""Fuzzing: damaged traffic into both ends of every wire, and which messages they accept.

An input is one to three valid messages with up to three kinds of damage. Nothing may crash or hang, and after any input
a valid message must be accepted. The messages that an end accepts are compared with what was fed to it:

- whole: a message that a sender made, counted at most as often as its bytes arrived.
- altered: bytes that arrived and passed every check, but that no sender made. A checksum of 16 bits passes one in
  65,536 of arbitrarily damaged messages, and none whose damage is one bit or one burst of up to 16 bits, so the
  expected number is at most the failed checks over 65,535. Text has no checksum: any text that parses as a command
  is one.
- unsent: a message that was accepted more often than its bytes arrived. There must be none.
"""

import random
import time
import traceback
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass

from hil.experiments.hardening.fuzz_targets import TARGETS, Target
from hil.experiments.hardening.mutations import damaged
from hil.experiments.runs.cells import Cell, Scalar, Values

PER_CELL = 2500
_PER_SESSION = 250


def fuzz_cells(inputs: int, first_seed: int) -> list[Cell]:
    """Equally many cells of each target, with at least `inputs` inputs in total."""
    each = -(-inputs // (len(TARGETS) * PER_CELL))
    return [
        Cell("fuzz", {"target": name, "inputs": PER_CELL}, first_seed + number)
        for name in TARGETS
        for number in range(each)
    ]


def fuzz_cell(parameters: Values, seed: int) -> dict[str, Scalar]:
    """The counts of one cell by name, and `failure`, the first traceback or an empty text."""
    draw = random.Random(f"{parameters['target']} {seed}")
    total: Counter[str] = Counter()
    longest_s, failure = 0.0, ""
    left = int(parameters["inputs"])
    while left:
        session = _Session(TARGETS[str(parameters["target"])](), draw)
        count = min(left, _PER_SESSION)
        left -= count
        session.run(count)
        total.update(session.counts)
        longest_s = max(longest_s, session.longest_s)
        failure = failure or session.failure
    return {**{name: total[name] for name in COUNTS}, "longest_ms": round(1e3 * longest_s, 3), "failure": failure}


COUNTS = ("inputs", "bytes", "whole", "altered", "unsent", "failed_checks", "crashes", "unresponsive")


@dataclass(frozen=True)
class Summary:
    """One target: its counts, and the expected number of altered messages at most, None for text.

    `longest_ms` is the processor time of the slowest input.
    """

    target: str
    counts: dict[str, int]
    most_altered: float | None
    longest_ms: float
    failures: tuple[str, ...]


def summarise(target: str, results: Sequence[Values]) -> Summary:
    """The sum of a target's cells."""
    counts = {name: sum(int(result[name]) for result in results) for name in COUNTS}
    chance = None if target.startswith("plaintext") else 2.0**-48 if target.endswith("signed") else 1.0 / 65_535
    return Summary(
        target,
        counts,
        None if chance is None else chance * counts["failed_checks"],
        max(float(result["longest_ms"]) for result in results),
        tuple(str(result["failure"]) for result in results if result["failure"]),
    )


class _Session:
    """One target and the inputs it is fed; a crash ends it."""

    def __init__(self, target: Target, draw: random.Random) -> None:
        self.counts: Counter[str] = Counter()
        self.longest_s = 0.0
        self.failure = ""
        self._target = target
        self._draw = draw

    def run(self, inputs: int) -> None:
        """Feed so many inputs, then check that a valid message is accepted."""
        target = self._target
        try:
            for _ in range(inputs):
                data, sealed = damaged(self._draw, target.traffic)
                target.made.update(sealed)
                self._feed(data)
            self._feed(target.filler)
            before = len(target.accepted)
            probe = target.probe_message()
            target.made.add(probe)
            self._feed(probe)
            self.counts["unresponsive"] += probe not in target.accepted[before:]
        except Exception:
            self.counts["crashes"] += 1
            self.failure = traceback.format_exc()
        finally:
            target.shutdown()
        self._count_accepted()

    def _feed(self, data: bytes) -> None:
        began_s = time.thread_time()
        self._target.feed(self._draw, data)
        self.longest_s = max(self.longest_s, time.thread_time() - began_s)
        self.counts["inputs"] += 1
        self.counts["bytes"] += len(data)

    def _count_accepted(self) -> None:
        stream = bytes(self._target.stream)
        self.counts["failed_checks"] += self._target.failed_checks
        for message, times in Counter(self._target.accepted).items():
            came = stream.count(message)
            self.counts["whole" if message in self._target.made else "altered"] += min(times, came)
            self.counts["unsent"] += max(0, times - came)
