"""A rectangle of the picture in which a tracker looks."""

from mtm_onboard.protocol.errors import MtmError

# Left, upper, right and lower edge in pixels, y down; right and lower are just outside.
Region = tuple[int, int, int, int]

LEAST_SIDE_PX = 8


def parse_region(text: str) -> Region:
    """The region `X0,Y0,X1,Y1`; raises MtmError when that is none."""
    try:
        left, upper, right, lower = (int(part) for part in text.split(","))
    except ValueError as error:
        raise MtmError(
            f"{text!r} is no region; write four whole numbers X0,Y0,X1,Y1 in pixels from the upper left corner"
        ) from error
    if min(left, upper) < 0 or right - left < LEAST_SIDE_PX or lower - upper < LEAST_SIDE_PX:
        raise MtmError(
            f"the region {text} is none that could hold a robot; X0,Y0 is its upper left corner, X1,Y1 the lower right "
            f"one, and they must be {LEAST_SIDE_PX} pixels apart at least"
        )
    return left, upper, right, lower


def checked_region(region: Region | None, size: tuple[int, int]) -> Region:
    """The region, or the whole picture of that width and height for None.

    Raises MtmError when the region reaches beyond the picture.
    """
    width, height = size
    if region is None:
        return 0, 0, width, height
    if region[2] > width or region[3] > height:
        raise MtmError(
            f"the region {','.join(map(str, region))} reaches beyond the picture, which is {width} x {height} pixels; "
            "choose one inside it"
        )
    return region
