"""The paper's result tables as symbol accuracies."""

import csv
from pathlib import Path

from mtm_audit.planning.plan import symbols_needed
from mtm_audit.planning.table import AccuracyPoint, AccuracyTable

_BITS = {"discovery": 3, "lander": 3, "reacher": 3, "football": 6}


def paper_table(world: str, **names: tuple[str, ...]) -> AccuracyTable:
    """Symbol accuracy is the L-th root of message accuracy, at t = T / L; a message is L trials.

    `names` give the channels that one measured channel stands for, such as x=("x", "y").
    """
    with (Path(__file__).parent / f"{world}.csv").open(encoding="utf-8") as file:
        rows = list(csv.DictReader(line for line in file if not line.startswith("#")))
    points = []
    for row in rows:
        alphabet = int(row["M"])
        symbols = symbols_needed(_BITS[world], alphabet)
        ticks, rest = divmod(int(row["T"]), symbols)
        assert rest == 0
        accuracy = (float(row["message_percent"]) / 100.0) ** (1.0 / symbols)
        trials = symbols * int(row["messages"])
        for name in names.get(row["channel"], (row["channel"],)):
            points.append(AccuracyPoint(name, alphabet, ticks, round(accuracy * trials), trials))
    return AccuracyTable(tuple(points))
