"""Independent reference for the key tree, version 2: openssl for SHAKE-256 and SHA-256, mpmath for the waveform.

Prints key_tree_v2.json. Nothing of the project is imported, and no numpy; needs the openssl program and mpmath.
"""

import json
import subprocess

from mpmath import cos, floor, log, mp, mpf, pi, sqrt

mp.prec = 200
MASTER = b"not a real master, only for test"
KEY_ID, FINGERPRINT = "fake-fleet", "fedcba9876543210"
FIRST, LAST = 20_480, 20_486
# The waveform of one window: 20 ticks at 50 Hz, band 5 to 20 Hz.
RATE_HZ, BAND_HZ, TICKS = 50, (5, 20), 20


def digest(name: str, message: bytes, size: int | None = None) -> bytes:
    length = [] if size is None else ["-xoflen", str(size)]
    command = ["openssl", "dgst", f"-{name}", *length, "-binary"]
    return subprocess.run(command, input=message, stdout=subprocess.PIPE, check=True).stdout


def stream(secret: bytes, label: str, integers: list[int], size: int = 32) -> bytes:
    words = b"".join(value.to_bytes(8, "little") for value in integers)
    return digest("shake256", secret + bytes([len(label)]) + label.encode() + words, size)


def waveform(secret: bytes, epoch: int, window: int, symbol: int, axis: int) -> list[str]:
    bins = [k for k in range(1, TICKS) if 2 * k < TICKS and BAND_HZ[0] <= mpf(k * RATE_HZ) / TICKS <= BAND_HZ[1]]
    data = stream(secret, "symbol", [epoch, window, symbol, axis], 16 * len(bins))
    amplitudes, phases = [], []
    for row in range(len(bins)):
        first = int.from_bytes(data[16 * row : 16 * row + 8], "little")
        second = int.from_bytes(data[16 * row + 8 : 16 * row + 16], "little")
        amplitudes.append(sqrt(-2 * log((floor(mpf(first) / 2048) + mpf("0.5")) / mpf(2) ** 53)))
        phases.append(2 * pi * floor(mpf(second) / 2048) / mpf(2) ** 53)
    scale = sqrt(2 / sum(amplitude**2 for amplitude in amplitudes))
    samples = [
        scale * sum(a * cos(2 * pi * k * t / TICKS - p) for k, a, p in zip(bins, amplitudes, phases, strict=True))
        for t in range(TICKS)
    ]
    return [mp.nstr(sample, 17) for sample in samples]


def main() -> None:
    number = int(FINGERPRINT, 16)
    name = digest("sha256", KEY_ID.encode())
    id_words = [int.from_bytes(name[place : place + 8], "little") for place in range(0, 32, 8)]
    fleet = stream(MASTER, "fleet", [number, *id_words])
    links = {LAST: stream(fleet, "chain", [number, FIRST, LAST])}
    for day in range(LAST, FIRST - 1, -1):
        links[day - 1] = stream(links[day], "step", [number, day - 1])
    days = []
    for day in range(FIRST, LAST + 1):
        secret = stream(links[day], "day", [number, day])
        channels = [stream(secret, "channel", [number, day, channel]) for channel in range(3)]
        tags = stream(secret, "tags", [number, day])
        bound = [number, *id_words, 0b111]
        tag = stream(tags, "tag 2", [*bound, day, 5, 0x0123456789ABCDEF], 8)
        pad = stream(tags, "slot", [*bound, day, 77], 8)
        days.append(
            {
                "day": day, "link": links[day].hex(), "secret": secret.hex(), "tags": tags.hex(),
                "channels": [channel.hex() for channel in channels],
                "tag_of_number_5": int.from_bytes(tag, "big") >> 32,
                "pad_of_slot_77": int.from_bytes(pad, "big") >> 32,
            }
        )  # fmt: skip
    secret = bytes.fromhex(days[2]["channels"][1])
    window = {"day": FIRST + 2, "channel": 1, "window": 77, "symbol": 3, "axis": 2, "rate_hz": RATE_HZ}
    samples = waveform(secret, FIRST + 2, 77, 3, 2)
    print(
        json.dumps(
            {
                "master": MASTER.hex(), "key_id": KEY_ID, "fingerprint": FINGERPRINT, "first": FIRST, "last": LAST,
                "anchor": links[FIRST - 1].hex(), "days": days,
                "waveform": window | {"band_hz": BAND_HZ, "ticks": TICKS, "samples": samples},
            },
            indent=1,
        )
    )  # fmt: skip


if __name__ == "__main__":
    main()
