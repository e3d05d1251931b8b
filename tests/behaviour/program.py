"""The project's programs as this checkout has them, with all that differs from run to run held still."""

import os
import subprocess
import sys
import tomllib
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).parents[2]
# 2026-01-31T12:00:00Z, for whoever asks what time it is: a rolling schedule begins its message by it.
_NOW_UNIX_S = 1769860800.0
_LAUNCH = (
    f"import sys, time; time.time = lambda: {_NOW_UNIX_S}; sys.argv[0] = {{name!r}}; "
    "from {module} import {function}; sys.exit({function}())"
)
_UMASK = 0o022
# Sums depend on the number of threads in their last digits, and tables and help on the width of the terminal.
_ENVIRONMENT = {
    "COLUMNS": "100", "LANG": "C.UTF-8", "LC_ALL": "C.UTF-8", "NO_COLOR": "1", "TERM": "dumb", "TZ": "UTC",
    "OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1", "MKL_NUM_THREADS": "1",
    "PYTHONHASHSEED": "0", "PYTHONPATH": str(ROOT),
}  # fmt: skip
_KEPT = ("HOME", "PATH")


@dataclass(frozen=True)
class Outcome:
    """How a program ended, and what it said."""

    exit_code: int
    stdout: bytes
    stderr: bytes


def run(argv: tuple[str, ...], folder: Path) -> Outcome:
    """Run a program in `folder`; `argv` begins with its name, as pyproject.toml has it."""
    kept = {name: os.environ[name] for name in _KEPT if name in os.environ}
    done = subprocess.run(
        [sys.executable, "-c", _launcher(argv[0]), *argv[1:]], cwd=folder, env=kept | _ENVIRONMENT, umask=_UMASK,
        stdin=subprocess.DEVNULL, capture_output=True, check=False,
    )  # fmt: skip
    return Outcome(done.returncode, done.stdout, done.stderr)


def _launcher(name: str) -> str:
    """Python that calls the program's entry point, wherever its module lies now."""
    scripts = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]["scripts"]
    module, _, function = scripts[name].partition(":")
    return _LAUNCH.format(name=name, module=module, function=function)
