"""Libraries of others that read a format: what is said when one is missing, or chokes on a file."""

import io
import warnings
from collections.abc import Iterator
from contextlib import contextmanager, redirect_stderr, redirect_stdout
from importlib import import_module
from pathlib import Path
from typing import Any

from mtm_onboard.protocol.errors import MtmError
from mtm_onboard.protocol.installing import install_command


def library(module: str, path: Path, what: str, extra: str = "logs") -> Any:
    """The imported module; raises MtmError that says what to install when it is missing.

    `what` names the format with its article, such as "a ROS bag".
    """
    try:
        return import_module(module)
    except ModuleNotFoundError as error:
        if (error.name or "").partition(".")[0] != module.partition(".")[0]:
            raise
        raise missing(module.partition(".")[0], path, what, extra) from error


def missing(needed: str, path: Path, what: str, extra: str = "logs") -> MtmError:
    """The refusal of a file whose library is not installed."""
    return MtmError(f"{path} is {what}, and reading it needs {needed}; install it with: {install_command(extra)}")


@contextmanager
def foreign(path: Path, what: str) -> Iterator[None]:
    """Turn whatever a library raises on a damaged file into one sentence, and keep what it prints to itself."""
    printed = io.StringIO()
    with warnings.catch_warnings(), redirect_stdout(printed), redirect_stderr(printed):
        warnings.simplefilter("ignore")
        try:
            yield
        except MtmError:
            raise
        except Exception as error:
            reason = " ".join(str(error).split())[:160] or type(error).__name__
            raise MtmError(f"{path} is {what} that cannot be read ({reason}); copy or export it again") from error
