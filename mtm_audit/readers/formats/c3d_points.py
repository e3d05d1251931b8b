"""What ezc3d makes of a file, in a process of its own: a damaged file can crash it or keep it busy for ever.

python -m mtm_audit.readers.formats.c3d_points FILE.c3d OUT.npz MEGABYTES
"""

import resource
import sys
from pathlib import Path
from typing import Any

import numpy as np


def main(path: str, out: str, megabytes: str) -> None:
    """Write points, residuals, labels, rate, unit and screen axes; whatever goes wrong ends in an exit code."""
    _, hard = resource.getrlimit(resource.RLIMIT_AS)
    wanted = int(megabytes) << 20
    resource.setrlimit(resource.RLIMIT_AS, (wanted if hard < 0 else min(wanted, hard), hard))
    import ezc3d

    content = ezc3d.c3d(path)
    point, data = content["parameters"]["POINT"], content["data"]
    points = np.asarray(data["points"], dtype=float)
    np.savez(
        Path(out),
        points=points,
        residuals=np.asarray(data["meta_points"]["residuals"], dtype=float)[0],
        labels=np.array(_labels(point, points.shape[1]), dtype=str),
        rate_hz=float(np.ravel(point["RATE"]["value"])[0]),
        unit=_word(point, "UNITS"),
        up=_word(point, "Y_SCREEN"),
    )


def _labels(point: Any, count: int) -> list[str]:
    """All labels; beyond 255 of them the format goes on in LABELS2, LABELS3 and so on."""
    keys = ["LABELS", *(f"LABELS{number}" for number in range(2, 20))]
    found = [str(label).strip() for key in keys if key in point for label in point[key]["value"]][:count]
    return found + [f"unnamed {number}" for number in range(len(found), count)]


def _word(point: Any, key: str) -> str:
    values = list(point[key]["value"]) if key in point else []
    return str(values[0]).strip().lower() if values else ""


if __name__ == "__main__":
    main(*sys.argv[1:])
