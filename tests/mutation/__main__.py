"""`make mutants`: modules are changed in every small way, and each time some test of theirs has to fail.

Survivors are looked up in docs/mutants.md, which says why no test could tell them apart; any other one is an error. A
run may be bounded in time: what was found out is kept in out/mutants.json while source and tests stay as they are, and
the next run goes on from there. The report in docs/mutants_report.md is written when all modules were asked for.
"""

import argparse
import math
import os
import sys
import tempfile
import time

from tests.mutation.fates import Row, explained_mutants, keep, load_fates, row_of, write_report
from tests.mutation.mutate import mutants_of
from tests.mutation.targets import ROOT, TARGETS, Target
from tests.mutation.trial import processor_time_s, survives

_UNFINISHED = 3
_KEEP_EVERY_S = 10.0
# Processor time for a mutant's tests: so many times what they take without one, and a little.
_TIMES, _LEAST_S = 3.0, 2.0


def main(arguments: list[str] | None = None) -> int:
    """Run; exit code 0 when every mutant was killed or is explained, 1 when not, 3 when not all were tried in time."""
    known = [target.module for target in TARGETS]
    parser = argparse.ArgumentParser(prog="python -m tests.mutation")
    parser.add_argument("modules", nargs="*", metavar="MODULE", help="only these; all when none is named")
    parser.add_argument("--seconds", type=float, default=math.inf, help="stop after so many seconds")
    asked = parser.parse_args(arguments)
    if unknown := sorted(set(asked.modules) - set(known)):
        parser.error(f"{unknown[0]} is no target; choose from {', '.join(known)}")
    os.chdir(ROOT)
    # The first example that fails is enough; the smallest is not looked for.
    os.environ["MTM_HYPOTHESIS"] = "mutants"
    end_s = time.monotonic() + asked.seconds
    with tempfile.TemporaryDirectory() as folder:
        os.environ["HYPOTHESIS_STORAGE_DIRECTORY"] = folder
        rows = [_tried(target, end_s) for target in TARGETS if not asked.modules or target.module in asked.modules]
    if not asked.modules:
        write_report(rows)
    if any(row.not_tried for row in rows):
        return _UNFINISHED
    return int(any(row.unexplained for row in rows))


def _tried(target: Target, end_s: float) -> Row:
    """Try the target's mutants until `end_s`, those that were not tried before."""
    source = target.source.read_text(encoding="utf-8")
    mutants, fates = mutants_of(source), load_fates(target)
    explained = explained_mutants().get(target.module, set())
    left = [mutant for mutant in mutants if mutant.name not in fates.tried]
    whole_s = processor_time_s(target, source) if left and time.monotonic() < end_s else 0.0
    if whole_s is None:
        sys.exit(f"the tests of {target.module} fail without any mutant; make them pass first")
    kept_s = time.monotonic()
    for mutant in left:
        if time.monotonic() >= end_s:
            break
        fates.tried[mutant.name] = not survives(target, mutant.source, _LEAST_S + _TIMES * whole_s)
        if time.monotonic() - kept_s > _KEEP_EVERY_S:
            keep(fates)
            kept_s = time.monotonic()
    keep(fates)
    row = row_of(fates, [mutant.name for mutant in mutants], explained)
    for mutant in mutants:
        if fates.tried.get(mutant.name) is False and mutant.name not in explained:
            print(f"survives: {target.module}: {mutant.name}", flush=True)
    print(f"{target.module}: {row.killed} killed, {row.explained} survive and are explained, {row.unexplained} survive "
          f"unexplained, {row.not_tried} not tried", flush=True)  # fmt: skip
    return row


if __name__ == "__main__":
    sys.exit(main())
