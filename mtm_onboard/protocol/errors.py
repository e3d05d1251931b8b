"""The exception that every part raises for bad input, and which exit code it becomes."""

from collections.abc import Iterator
from contextlib import contextmanager


class MtmError(Exception):
    """Bad input or a refused action; its text is one sentence that says what is wrong and what to do."""

    exit_code = 1


class WrongValueError(MtmError):
    """A value on the command line that could not be right whatever the files hold."""

    exit_code = 2


@contextmanager
def command_line_values() -> Iterator[None]:
    """Make a `WrongValueError` of an `MtmError` in the block, which looks at nothing but the command line."""
    try:
        yield
    except MtmError as error:
        raise WrongValueError(str(error)) from error
