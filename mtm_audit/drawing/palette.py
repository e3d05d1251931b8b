"""Colours that show on films of gray floors, dark robots and white margins, told apart also by the colour-blind."""

from typing import TypeAlias

Bgr: TypeAlias = tuple[int, int, int]

WHITE: Bgr = (255, 255, 255)
HALO: Bgr = (20, 20, 20)
_COLOURS: tuple[Bgr, ...] = (
    (0, 190, 255), (255, 200, 70), (120, 230, 90), (220, 130, 255), (60, 240, 250), (60, 120, 255), (235, 235, 130),
    (200, 180, 255),
)  # fmt: skip


def colour_of(number: int) -> Bgr:
    """Blue, green and red of the thing with that number; colours come again after eight."""
    return _COLOURS[number % len(_COLOURS)]
