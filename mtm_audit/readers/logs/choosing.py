"""Which parts of a log are read: those that were asked for, or the one that leaves no choice."""

from collections.abc import Sequence
from pathlib import Path

from mtm_onboard.protocol.errors import MtmError

_MOST_LISTED = 30


def listed(names: Sequence[str]) -> str:
    """The names in one line, which may be cut."""
    more = f" and {len(names) - _MOST_LISTED} more" if len(names) > _MOST_LISTED else ""
    return ", ".join(names[:_MOST_LISTED]) + more


def check_topics(path: Path, asked: Sequence[str], present: Sequence[str]) -> None:
    """Raise MtmError when something was asked for that the log does not hold, and list what it does."""
    for name in asked:
        if name not in present:
            raise MtmError(f"{path} has no {name}; it has: {listed(present) or 'nothing with a pose'}")


class SeveralPosesError(MtmError):
    """A log holds several poses, the names of which are `offered`, and none was asked for."""

    def __init__(self, sentence: str, offered: Sequence[str]) -> None:
        super().__init__(sentence)
        self.offered = tuple(offered)


def choose(path: Path, present: Sequence[str]) -> SeveralPosesError:
    """The refusal of a log that holds several poses none of which was asked for."""
    return SeveralPosesError(f"{path} holds several poses; name one or more with --topic: {listed(present)}", present)
