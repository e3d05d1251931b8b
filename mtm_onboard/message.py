"""Messages, as the modulator plays them: the symbols of each slot."""

from dataclasses import dataclass
from typing import Protocol


class Message(Protocol):
    """What a robot sends from one slot to the next."""

    @property
    def number(self) -> int:
        """Counts the messages of a run; carried in the frame when the scheme says so."""
        ...

    def symbols(self, slot: int) -> tuple[int, ...]:
        """The whole message's L symbols in the order in which `slot` plays them. May be called from any thread."""
        ...


@dataclass(frozen=True)
class PlainMessage:
    """The same symbols in every slot."""

    played: tuple[int, ...]
    number: int = 0

    def symbols(self, slot: int) -> tuple[int, ...]:
        """All L of them."""
        return self.played
