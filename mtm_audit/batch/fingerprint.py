"""Which state of a program's code, and of the libraries under it, computed a result."""

import hashlib
from collections.abc import Sequence
from functools import cache
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

_ROOT = Path(__file__).parents[2]
# Beside the code what it computes with: the plant, the paper's points, a policy's weights.
_SUFFIXES = (".py", ".toml", ".csv", ".npz")
_DIGITS = 16
# Each changed what is measured in a picture or read from a log from one release to another.
_LIBRARIES = ("numpy", "scipy", "opencv-python-headless", "av", "ezc3d", "mcap", "pymavlink", "pyulog", "rosbags")
_READING = ("mtm_audit/model", "mtm_audit/readers", "mtm_audit/tracking", "mtm_audit/ingest")
_DECODING = ("mtm_audit", "mtm_onboard/protocol")


def fingerprint(root: Path, packages: Sequence[str], libraries: Sequence[str] = ()) -> str:
    """Sixteen hexadecimal digits that differ when any file of the folders `packages` under `root` differs which
    computes, or the installed version of one of `libraries`.
    """
    digest = hashlib.sha256()
    for package in packages:
        for path in sorted(path for path in (root / package).rglob("*") if path.suffix in _SUFFIXES):
            digest.update(str(path.relative_to(root)).encode() + b"\0" + path.read_bytes() + b"\0")
    for library in libraries:
        digest.update(f"{library} {_installed(library)}\0".encode())
    return digest.hexdigest()[:_DIGITS]


@cache
def reading_fingerprint() -> str:
    """Of what turns files into tracks."""
    return fingerprint(_ROOT, _READING, _LIBRARIES)


@cache
def decoding_fingerprint() -> str:
    """Of everything between files and a verdict."""
    return fingerprint(_ROOT, _DECODING, _LIBRARIES)


def _installed(library: str) -> str:
    try:
        return version(library)
    except PackageNotFoundError:
        return ""
