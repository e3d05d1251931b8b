"""`mtm-hil demo`: a message from a fresh key to the auditor's verdicts."""

import json
import os
import shlex
import subprocess
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path

from rich.console import Console
from rich.table import Table

from hil.commands.new_folder import new_folder
from hil.fleet.programs import program
from mtm_audit.batch.processes import SINGLE_THREADED
from mtm_onboard.protocol import MtmError

MESSAGE = 0b10110010
SECONDS = 14
PLOT, REPORT, STILL = "decode.png", "report.html", "overlay.png"
_AT_ONCE = 2
_VERDICT_CODES = (0, 3, 4)


@dataclass(frozen=True)
class _Check:
    """One decode of the demo and what must come out of it: the message, or None for the verdict "absent"."""

    what: str
    arguments: str
    expected: int | None


_KEYS = ("robot", "other")
_RECORDINGS = (
    f"mtm-hil record --out message --message {MESSAGE} --key robot.key --seconds {SECONDS}",
    f"mtm-hil record --out silent --no-message --no-video --key robot.key --seconds {SECONDS} --seed 1",
)
_CHECKS = (
    _Check("video", f"message/video.mp4 --key robot.key --plot {PLOT} --report {REPORT} --overlay {STILL}", MESSAGE),
    _Check("motion capture", "message/mocap --key robot.key", MESSAGE),
    _Check("another key", "message/mocap --key other.key", None),
    _Check("no message sent", "silent/mocap --key robot.key", None),
)


def demo(out: Path, console: Console) -> bool:
    """Make keys and recordings in the new folder `out`, decode them, and return whether all is as it should be.

    Raises MtmError when `out` exists or one of the programs fails.
    """
    with new_folder(out) as folder:
        print(f"in {out}, with the programs that a user would call:")
        _run_all(
            folder,
            [f"mtm-onboard keygen --preset paper-robomaster-fleet --id {name} --out {name}.key" for name in _KEYS],
        )
        _run_all(folder, _RECORDINGS)
        answers = _decode_all(folder)
    good = [_is_expected(check, answer) for check, answer in zip(_CHECKS, answers, strict=True)]
    console.print(_table(answers, good))
    print(f"the decode of the video is drawn in {out / PLOT}, and told in {out / REPORT}, for a browser")
    print(f"what was seen in the video is drawn over a picture of it in {out / STILL}")
    return all(good)


def _run_all(folder: Path, commands: Sequence[str], codes: tuple[int, ...] = (0,)) -> list[str]:
    """Run programs in `folder`, two at a time, and return what each printed.

    Raises MtmError when one ends with an exit code that is not among `codes`.
    """
    environment = os.environ | SINGLE_THREADED

    def run(command: str) -> str:
        name, *arguments = shlex.split(command)
        done = subprocess.run(
            [program(name), *arguments], cwd=folder, env=environment, capture_output=True, text=True, check=False
        )
        if done.returncode not in codes:
            words = done.stderr.strip().splitlines()
            raise MtmError(f"'{command}' ended with code {done.returncode} ({words[-1] if words else 'no output'})")
        return done.stdout

    for command in commands:
        print(f"$ {command}", flush=True)
    with ThreadPoolExecutor(_AT_ONCE) as pool:
        return list(pool.map(run, commands))


def _decode_all(folder: Path) -> list[tuple[str, int | None]]:
    """Verdict and message of each check."""
    commands = [f"mtm-audit decode {check.arguments} --json" for check in _CHECKS]
    answers = []
    for command, text in zip(commands, _run_all(folder, commands, _VERDICT_CODES), strict=True):
        try:
            answer = json.loads(text)
            answers.append((answer["verdict"], answer["message"]))
        except (ValueError, KeyError, TypeError) as error:
            raise MtmError(f"'{command}' gave no verdict; try it by itself") from error
    return answers


def _is_expected(check: _Check, answer: tuple[str, int | None]) -> bool:
    return answer == (("absent", None) if check.expected is None else ("decoded", check.expected))


def _table(answers: list[tuple[str, int | None]], good: list[bool]) -> Table:
    table = Table("decoded from", "verdict", "message", "", title=f"message sent: {MESSAGE:08b} ({MESSAGE})")
    for check, (verdict, message), is_good in zip(_CHECKS, answers, good, strict=True):
        text = "" if message is None else f"{message:08b} ({message})"
        table.add_row(check.what, verdict, text, "as it should be" if is_good else "WRONG")
    return table
