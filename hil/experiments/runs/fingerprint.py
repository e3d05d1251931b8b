"""Which state of the project computed a result."""

import hashlib
from functools import cache
from pathlib import Path

_ROOT = Path(__file__).parents[3]
_PACKAGES = ("mtm_onboard", "mtm_audit", "hil")
# Beside the code what it computes with: the plant, the paper's points, a policy's weights.
_SUFFIXES = (".py", ".toml", ".csv", ".npz")


@cache
def code_fingerprint(root: Path = _ROOT) -> str:
    """Sixteen hexadecimal digits that differ when any file differs which the packages under `root` compute with."""
    digest = hashlib.sha256()
    for package in _PACKAGES:
        for path in sorted(path for path in (root / package).rglob("*") if path.suffix in _SUFFIXES):
            digest.update(str(path.relative_to(root)).encode() + b"\0" + path.read_bytes() + b"\0")
    return digest.hexdigest()[:16]
