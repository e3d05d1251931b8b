"""Detectors: they score every candidate symbol of every window against a glimpse."""

from mtm_audit.detectors.base import Detector
from mtm_audit.detectors.matched.profile import PlantProfile
from mtm_onboard.protocol.errors import MtmError, WrongValueError

DETECTORS = ("coherency", "matched")


def make_detector(name: str, profile: PlantProfile | None = None) -> Detector:
    """The detector of that name; raises MtmError when there is none, or none that takes a plant's profile."""
    if name not in DETECTORS:
        raise WrongValueError(f"there is no detector {name!r}; choose one of: {', '.join(DETECTORS)}")
    # Each needs much that the other does not.
    if name == "matched":
        from mtm_audit.detectors.matched.detector import MatchedDetector

        return MatchedDetector(profile)
    if profile is not None:
        raise MtmError(f"the detector {name!r} takes no profile; leave --profile out or choose --detector matched")
    from mtm_audit.detectors.coherency import CoherencyDetector

    return CoherencyDetector()
