"""Which state of the project computed a result."""

from functools import cache
from pathlib import Path

from mtm_audit.batch.fingerprint import fingerprint

_ROOT = Path(__file__).parents[3]
_PACKAGES = ("mtm_onboard", "mtm_audit", "hil")


@cache
def code_fingerprint(root: Path = _ROOT) -> str:
    """Sixteen hexadecimal digits that differ when any file differs which the packages under `root` compute with."""
    return fingerprint(root, _PACKAGES)
