"""Running all commands and keeping what they did.

FOLDER/work/inputs     what they read
FOLDER/work/<name>     where each ran
FOLDER/<name>.txt      its transcript
"""

import shutil
import time
from collections.abc import Sequence
from pathlib import Path

from tests.behaviour.commands import Command
from tests.behaviour.inputs import write_inputs
from tests.behaviour.program import run
from tests.behaviour.transcript import missing, transcript

SUFFIX = ".txt"


def record(folder: Path, commands: Sequence[Command]) -> bool:
    """Make `folder` and all in it; False when some command did not end as it should, or wrote less."""
    work = folder / "work"
    work.mkdir(parents=True)
    write_inputs(work / "inputs")
    good = [_record(folder, command) for command in commands]
    print(f"{sum(good)} of {len(good)} commands ended as they should")
    return all(good)


def _record(folder: Path, command: Command) -> bool:
    work = folder / "work"
    own = work / command.name
    own.mkdir()
    for source, target in command.copies:
        shutil.copyfile(work / source, own / target)
    began_s = time.monotonic()
    outcome = run(command.argv, own)
    took_s = time.monotonic() - began_s
    text = transcript(command, outcome, own, folder)
    (folder / f"{command.name}{SUFFIX}").write_bytes(text.encode())
    faults = [f"{name} was not written" for name in missing(command, own)]
    if outcome.exit_code != command.ends_with:
        faults.append(f"exit code {outcome.exit_code} instead of {command.ends_with}")
    print(f"{command.name}, {took_s:.1f} s: {', '.join(faults) or 'as it should be'}", flush=True)
    return not faults
