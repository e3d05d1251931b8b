"""Independent reference for waveforms with a spectrum: openssl for SHAKE-256, mpmath with 200 bits for the rest.

Prints waveform_spectrum_v1.json. Nothing of the project is imported, and no numpy; needs the openssl program and
mpmath.
"""

import json
import subprocess
from itertools import pairwise

from mpmath import cos, floor, log, mp, mpf, pi, sqrt

mp.prec = 200
SECRET = b"not a real secret, only for test"
SLOPE = (("0.5", "0"), ("5", "-9"))
FLOOR = (("0.9", "-10"), ("1", "0"), ("2", "0"), ("2.1", "-10"))
BUMP = (("1.5", "-3.5"), ("2.25", "4"), ("3", "-20"))
# Rate, band, window ticks, points, power, and epoch, window, symbol and axis of the stream.
CASES = (
    ("50", ("0.5", "5"), 100, SLOPE, "ensemble", (0, 0, 0, 0)),
    ("50", ("0.5", "5"), 100, SLOPE, "window", (0, 0, 3, 1)),
    ("10", ("0.1", "4.9"), 120, FLOOR, "window", (3, 7, 300, 0)),
    ("10", ("0.1", "4.9"), 121, FLOOR, "ensemble", (0, 0, 1, 2)),
    ("50", ("0.3", "8"), 133, BUMP, "window", (20480, 11, 511, 2)),
)


def stream(integers: tuple[int, ...], size: int) -> bytes:
    words = b"".join(value.to_bytes(8, "little") for value in integers)
    command = ["openssl", "dgst", "-shake256", "-xoflen", str(size), "-binary"]
    message = SECRET + bytes([len("symbol")]) + b"symbol" + words
    return subprocess.run(command, input=message, stdout=subprocess.PIPE, check=True).stdout


def level(points: tuple[tuple[str, str], ...], frequency: mpf) -> mpf:
    known = [(mpf(hz), mpf(db)) for hz, db in points]
    if frequency <= known[0][0]:
        return known[0][1]
    for (low, first), (high, last) in pairwise(known):
        if frequency <= high:
            return first + (last - first) * (frequency - low) / (high - low)
    return known[-1][1]


def main() -> None:
    vectors = []
    for rate, band, ticks, points, power, place in CASES:
        bins = [
            k for k in range(1, ticks) if 2 * k < ticks and mpf(band[0]) <= mpf(k) * mpf(rate) / ticks <= mpf(band[1])
        ]
        data = stream(place, 16 * len(bins))
        amplitudes, phases = [], []
        for row in range(len(bins)):
            first = int.from_bytes(data[16 * row : 16 * row + 8], "little")
            second = int.from_bytes(data[16 * row + 8 : 16 * row + 16], "little")
            amplitudes.append(sqrt(-2 * log((floor(mpf(first) / 2048) + mpf("0.5")) / mpf(2) ** 53)))
            phases.append(2 * pi * floor(mpf(second) / 2048) / mpf(2) ** 53)
        relative = [mpf(10) ** (level(points, mpf(k) * mpf(rate) / ticks) / 10) for k in bins]
        powers = [len(bins) * one / sum(relative) for one in relative]
        scale = sqrt(mpf(1) / len(bins)) if power == "ensemble" else sqrt(2 / sum(one**2 for one in amplitudes))
        samples = [
            scale
            * sum(
                sqrt(w) * a * cos(2 * pi * k * t / ticks - p)
                for k, w, a, p in zip(bins, powers, amplitudes, phases, strict=True)
            )
            for t in range(ticks)
        ]
        vectors.append(
            {
                "key_hex": SECRET.hex(), "rate_hz": rate, "band_hz": band, "window_ticks": ticks, "spectrum": points,
                "epoch": place[0], "window": place[1], "symbol": place[2], "axis": place[3], "power": power,
                "bins": bins, "powers": [mp.nstr(one, 17) for one in powers],
                "samples": [mp.nstr(one, 17) for one in samples],
            }
        )  # fmt: skip
    print(json.dumps(vectors, indent=1))


if __name__ == "__main__":
    main()
