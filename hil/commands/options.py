"""What the commands of `mtm-hil` share."""

from collections.abc import Iterator
from contextlib import contextmanager
from enum import StrEnum
from typing import TYPE_CHECKING

from mtm_audit.commands.errors import reported

if TYPE_CHECKING:
    from rich.console import Console

CELLS_HELP = "Finished rollouts; a run that was interrupted goes on from there."


class Renderer(StrEnum):
    """Who draws the pictures of a simulated world."""

    SOFTWARE = "software"
    NATIVE = "native"


@contextmanager
def reported_console() -> Iterator["Console"]:
    """A console for a command whose errors are told in one sentence, with the exit code they have."""
    from rich.console import Console

    with reported("mtm-hil", "no half-written result is left"):
        yield Console()
