"""What stands in the place of a result when whatever computed it ended."""

from dataclasses import dataclass


@dataclass(frozen=True)
class Lost:
    """Each process that worked on it ended before it was done, from outside or by a crash."""
