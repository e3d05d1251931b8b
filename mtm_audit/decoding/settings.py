"""How to decode."""

from collections.abc import Mapping
from dataclasses import dataclass, field

from mtm_audit.detectors.matched.profile import PlantProfile
from mtm_audit.model.recorded_at import RecordedAt
from mtm_onboard.protocol.revocation import RevocationList

# Decoys are all that the paper's detector has to compare with; matched needs none.
_USUAL_DECOYS = {"coherency": 40}


@dataclass(frozen=True, kw_only=True)
class DecodeSettings:
    """`onset_s` None searches for the message's start; `assignment` maps bodies to track names.

    `threshold` is how often the answer "decoded" may be wrong. `decoys` None takes as many as the detector needs.
    `profile` is what is known of the robots' plant beforehand; the detector must take one. `at` is when the recording
    was made, which a rolling schedule needs.
    `revoked` lists key files that are no longer trusted.
    """

    detector: str = "matched"
    onset_s: float | None = None
    decoys: int | None = None
    threshold: float = 1e-4
    assignment: Mapping[str, str] = field(default_factory=dict)
    profile: PlantProfile | None = None
    at: RecordedAt | None = None
    revoked: RevocationList = field(default_factory=RevocationList)

    @property
    def decoy_count(self) -> int:
        """How many decoys are searched beside the key."""
        return _USUAL_DECOYS.get(self.detector, 0) if self.decoys is None else self.decoys
