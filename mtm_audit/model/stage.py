"""The stages of a decode, and the error that says at which one it ended."""

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Literal

from mtm_onboard.protocol.errors import MtmError

StageName = Literal["key", "recording", "tracks", "glimpse", "timing", "detector", "symbols", "message", "verdict"]


class StageError(MtmError):
    """A refusal in one sentence, with the `stage` that could not go on."""

    def __init__(self, stage: StageName, sentence: str) -> None:
        super().__init__(sentence)
        self.stage = stage


@contextmanager
def stage(name: StageName) -> Iterator[None]:
    """Name the stage of whatever refusal comes from inside, unless an inner stage already did."""
    try:
        yield
    except StageError:
        raise
    except MtmError as error:
        raise StageError(name, str(error)) from error
