"""The console that answers are laid out on."""

import sys

from rich.console import Console

_PIPE_COLUMNS = 140


def answer_console() -> Console:
    """As wide as the terminal; in a pipe wide: nobody sees there where a line ends, and a cut table cannot be read.

    What users name is printed as it is: a track may be called body[left].
    """
    return Console(width=None if sys.stdout.isatty() else _PIPE_COLUMNS, markup=False, emoji=False)
