"""What may differ between two runs of the same code, taken out of a text."""

import re
from pathlib import Path

from tests.behaviour.program import ROOT

# Dates need nothing of the kind: programs are told a fixed time of day.
_ELAPSED = re.compile(r"(?<=\btook )\d+(\.\d+)? (ms|s|seconds|minutes)\b")
# On standard error, where no program has drawn anything before.
_FONT_CACHE = re.compile(r"^Matplotlib is building the font cache.*\n", re.MULTILINE)


def normalised(data: bytes, folder: Path) -> str | None:
    """The text with `folder`, the checkout and elapsed times replaced by names; None when it is no text."""
    try:
        text = data.decode("utf-8")
    except UnicodeDecodeError:
        return None
    if "\0" in text:
        return None
    text = text.replace(str(folder), "FOLDER").replace(str(ROOT), "CHECKOUT")
    return _ELAPSED.sub("ELAPSED", _FONT_CACHE.sub("", text))
