"""Detectors: they score every candidate symbol of every window against a glimpse."""

from mtm_audit.detectors.base import Detector
from mtm_audit.detectors.coherency import CoherencyDetector
from mtm_audit.detectors.matched.detector import MatchedDetector
from mtm_onboard.protocol.errors import MtmError

DETECTORS: dict[str, type[CoherencyDetector] | type[MatchedDetector]] = {
    "coherency": CoherencyDetector,
    "matched": MatchedDetector,
}


def make_detector(name: str) -> Detector:
    """The detector of that name; raises MtmError when there is none."""
    if name not in DETECTORS:
        raise MtmError(f"there is no detector {name!r}; choose one of: {', '.join(DETECTORS)}")
    return DETECTORS[name]()
