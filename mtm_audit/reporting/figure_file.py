"""Figures as files that carry the mark of the command that drew them."""

import warnings
from pathlib import Path

from matplotlib.figure import Figure

from mtm_onboard.protocol.atomicfile import replacing
from mtm_onboard.protocol.output_file import mark_of

# What each format calls the program that made it.
_MAKER_FIELDS = {"png": "Software", "pdf": "Creator", "svg": "Creator"}


def save_figure(figure: Figure, path: Path, command: str) -> None:
    """Write the figure in the format of the path's suffix, whole or not at all, with the mark of `command`.

    Raises MtmError when it cannot be written, or a key file stands there.
    """
    suffix = path.suffix.lower().removeprefix(".")
    with replacing(path) as temporary, warnings.catch_warnings():
        # Names in scripts that the font lacks are drawn as boxes, and that is seen.
        warnings.filterwarnings("ignore", message="Glyph .* missing from")
        figure.savefig(temporary, format=suffix, metadata={_MAKER_FIELDS[suffix]: mark_of(command)})
