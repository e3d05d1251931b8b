"""The finding of a check, and how findings are printed."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any, Literal

Status = Literal["pass", "warn", "fail"]
_WORST_LAST: tuple[Status, ...] = ("pass", "warn", "fail")


@dataclass(frozen=True)
class Finding:
    """What was checked, its status, and in words what to do about it; the names of `figures` hold their unit."""

    check: str
    status: Status
    text: str
    figures: dict[str, float] = field(default_factory=dict)


def worst(findings: Sequence[Finding]) -> Status:
    """The worst status of all; pass when there are none."""
    return max((finding.status for finding in findings), key=_WORST_LAST.index, default="pass")


def as_lines(findings: Sequence[Finding]) -> list[str]:
    """One line each."""
    return [f"{finding.status}  {finding.check:<14}{finding.text}" for finding in findings]


def as_table(findings: Sequence[Finding]) -> dict[str, Any]:
    """What `mtm-onboard doctor --json` prints, see docs/doctor.md."""
    checks = [
        {"check": each.check, "status": each.status, "text": each.text, "figures": each.figures} for each in findings
    ]
    return {"format": 1, "status": worst(findings), "checks": checks}
