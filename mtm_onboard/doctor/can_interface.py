"""A CAN interface of Linux, as /sys/class/net and `ip` show it; nothing is sent on its bus."""

import json
import shutil
import subprocess
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from typing import Any

from mtm_onboard.doctor.finding import Finding

_INTERFACES = Path("/sys/class/net")
_ARPHRD_CAN = 280  # from <linux/if_arp.h>
_IFF_UP = 1  # from <linux/if.h>
# Heartbeats and commands come in bursts of some thirty frames.
_SHORTEST_QUEUE = 100
_TIMEOUT_S = 5.0


def link_details(name: str) -> dict[str, Any] | None:
    """What `ip` reports of the interface beyond /sys; None without iproute2, or when it reports nothing."""
    program = shutil.which("ip")
    if program is None:
        return None
    with suppress(OSError, subprocess.SubprocessError, ValueError, LookupError, TypeError):
        asked = [program, "-details", "-json", "link", "show", "dev", name]
        shown = subprocess.run(asked, check=True, capture_output=True, timeout=_TIMEOUT_S).stdout
        return dict(json.loads(shown)[0]["linkinfo"])
    return None


def check_interface(
    name: str,
    bitrate: int,
    folder: Path = _INTERFACES,
    details: Callable[[str], dict[str, Any] | None] = link_details,
) -> Finding:
    """Check that the interface exists, is up, has the robot's bit rate and room for a burst, and sees no bus errors."""
    place = folder / name
    if not name or not place.is_dir():
        return Finding("link", "fail", f"there is no CAN interface {name!r}; plug the adapter in, and see ip link")
    if int(_entry(place, "type")) != _ARPHRD_CAN:
        return Finding("link", "fail", f"{name} is no CAN interface; correct channel in [transport]")
    if not int(_entry(place, "flags"), 16) & _IFF_UP:
        return Finding("link", "fail", f"{name} is down; run: {_up(name, bitrate)}")
    known = details(name)
    if known is not None and known.get("info_kind") == "vcan":
        return Finding("link", "pass", f"{name} is up; it is virtual, so no robot is on it")
    if known is None:
        return Finding("link", "warn", f"{name} is up, but its bit rate is not seen; install iproute2")
    return _check_bus(name, bitrate, known.get("info_data", {}), int(_entry(place, "tx_queue_len")))


def _check_bus(name: str, bitrate: int, data: dict[str, Any], queue: int) -> Finding:
    found, state = data.get("bittiming", {}).get("bitrate"), data.get("state")
    if found != bitrate:
        return Finding(
            "link", "fail",
            f"{name} has the bit rate {found} and the robot {bitrate}; run: ip link set {name} down; "
            f"{_up(name, bitrate)}",
        )  # fmt: skip
    if state == "BUS-OFF":
        return Finding(
            "link", "fail", f"{name} is off the bus after errors; check wiring and termination, then restart it"
        )
    if state in ("ERROR-WARNING", "ERROR-PASSIVE"):
        return Finding("link", "warn", f"{name} sees errors ({state}); check wiring, termination and the robot's power")
    if queue < _SHORTEST_QUEUE:
        return Finding(
            "link", "warn", f"{name} queues {queue} frames and would drop some; run: ip link set {name} txqueuelen 1000"
        )
    return Finding("link", "pass", f"{name} is up at {bitrate} bit/s")


def _up(name: str, bitrate: int) -> str:
    return f"ip link set {name} type can bitrate {bitrate} restart-ms 100; ip link set {name} txqueuelen 1000 up"


def _entry(place: Path, name: str) -> str:
    return (place / name).read_text(encoding="ascii").strip()
