"""Whether the programs still do what they did: record a fixed set of commands before a change and after, and compare.

    python -m tests.behaviour record FOLDER
    python -m tests.behaviour compare FOLDER_A FOLDER_B

Exit codes: 0 recorded, or both recordings are the same; 1 a command did not end as it should, or the recordings differ;
2 usage. Hold recordings of one machine against each other: other processors round sums and encode films differently.
"""

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path

from tests.behaviour.commands import COMMANDS
from tests.behaviour.comparison import differences, is_recording
from tests.behaviour.recording import record


def main(arguments: Sequence[str] | None = None) -> int:
    """Run `record` or `compare` and return the exit code; usage errors leave with 2 through SystemExit."""
    parser = argparse.ArgumentParser(
        prog="python -m tests.behaviour", description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    subparsers = parser.add_subparsers(dest="action", required=True)
    recorder = subparsers.add_parser("record", help="run all commands and keep what they did")
    recorder.add_argument("folder", type=Path, help="the folder to make; it must not exist")
    comparer = subparsers.add_parser("compare", help="print the first lines that differ, command by command")
    comparer.add_argument("before", type=Path, help="a recording")
    comparer.add_argument("after", type=Path, help="another one")
    args = parser.parse_args(arguments)
    if args.action == "record":
        if args.folder.exists():
            recorder.error(f"{args.folder} exists already; choose another folder or remove it first")
        return int(not record(args.folder.resolve(), COMMANDS))
    for folder in (args.before, args.after):
        if not is_recording(folder):
            comparer.error(f"{folder} is no recording; make one with record")
    return _compare(args.before, args.after)


def _compare(before: Path, after: Path) -> int:
    found = differences(before, after)
    for name, lines in found.items():
        print("\n  ".join([f"{name} differs:", *lines]))
    print(f"{len(found)} commands differ" if found else "all commands did the same")
    return int(bool(found))


if __name__ == "__main__":
    sys.exit(main())
