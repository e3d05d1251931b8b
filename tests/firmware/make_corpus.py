"""Write seeds for the fuzzers: `python -m tests.firmware.make_corpus image|gateway folder`."""

import sys
from pathlib import Path

from mtm_onboard.firmware.image import image_bytes
from tests.firmware.shim_gateway import cut, speed_message
from tests.firmware.test_playing import message_image
from tests.firmware.test_wire import FRAMES, built

_STEP = b"\x08"


def image_seeds() -> list[bytes]:
    images = [message_image(), message_image("rolling", messages=2), message_image(repeat=False)]
    return [bytes([first]) + image_bytes(image) for image in images for first in (0, 1, 0x91)]


def gateway_seeds() -> list[bytes]:
    wheel = built(0xC9, 0xC3, 1, 0, 0x3F, 0x20, bytes(8))
    messages = [speed_message(0.5, -0.2, 30.0), wheel, speed_message(0.1, 0.1, 0.0), *FRAMES[::9]]
    streams = [cut(b"".join(messages), size) for size in (1, 3, 8)]
    return [b"".join(_STEP + bytes([len(f.data)]) + f.data + b"\xff" for f in frames) for frames in streams]


def main(target: str, folder: Path) -> None:
    seeds = {"image": image_seeds, "gateway": gateway_seeds}[target]()
    for number, seed in enumerate(seeds):
        (folder / f"seed_{number}").write_bytes(seed)


if __name__ == "__main__":
    main(sys.argv[1], Path(sys.argv[2]))
