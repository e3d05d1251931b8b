"""`mtm-onboard device-key`: a key for one device that plays images, which is not the fleet's."""

import argparse
from pathlib import Path


def add_parser(subparsers: "argparse._SubParsersAction[argparse.ArgumentParser]") -> None:
    """Add the command and its options."""
    parser = subparsers.add_parser("device-key", help="make a key with which images for one device are sealed")
    parser.add_argument("--out", required=True, type=Path, metavar="FILE", help="the file to write; it must not exist")
    parser.set_defaults(handler=_device_key)


def _device_key(args: argparse.Namespace) -> int:
    from mtm_onboard.firmware.device_key import new_device_key

    new_device_key(args.out)
    print(f"wrote a device key to {args.out}; put its 32 bytes into the device, and keep it secret")
    return 0
