"""Whether the robot's link could be opened, for each kind of transport; nothing is sent over it."""

import errno
import fcntl
import grp
import os
import socket
from collections.abc import Callable
from contextlib import suppress
from importlib.util import find_spec

from mtm_onboard.doctor.can_interface import check_interface
from mtm_onboard.doctor.finding import Finding
from mtm_onboard.links.factory import make_link
from mtm_onboard.protocol import MtmError
from mtm_onboard.protocol.installing import install_command
from mtm_onboard.runtime.config import Option

Options = dict[str, Option]

_CONNECT_WITHIN_S = 3.0
# python-can's interfaces whose channel is a serial device.
_SERIAL_CAN = ("slcan", "robotell", "seeedstudio")
_VIRTUAL_CAN = ("virtual", "udp_multicast")


def check_link(kind: str, options: Options) -> Finding:
    """Check what this kind of transport needs; the options are checked by making the transport without opening it."""
    try:
        make_link(kind, options)
        return _CHECKS[kind](options)
    except MtmError as error:
        return Finding("link", "fail", str(error))
    except (OSError, ValueError, TypeError, LookupError) as error:
        return Finding("link", "fail", f"these options cannot be used ({error}); correct [transport]")


def check_serial(path: str) -> Finding:
    """Check that this user may open the serial device and that no other program holds it."""
    if find_spec("serial") is None:
        return Finding("link", "fail", f"pyserial is not installed; run {install_command('serial')}")
    try:
        descriptor = os.open(path, os.O_RDWR | os.O_NOCTTY | os.O_NONBLOCK)
    except OSError as error:
        return Finding("link", "fail", f"{path} cannot be opened ({error.strerror}); {_serial_remedy(path, error)}")
    try:
        if not os.isatty(descriptor):
            return Finding("link", "fail", f"{path} is not a serial line; correct it in [transport]")
        fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError:
        return Finding("link", "fail", f"another program holds {path}; end it")
    finally:
        os.close(descriptor)
    return Finding("link", "pass", f"{path} can be opened")


def _serial_remedy(path: str, error: OSError) -> str:
    if error.errno == errno.ENOENT:
        return "plug it in; ls /dev/serial/by-id shows what is there"
    if error.errno in (errno.EACCES, errno.EPERM):
        return f"add this user to the group {_group(path)}: sudo usermod -aG {_group(path)} USER, and log in anew"
    return "end the program that has it, or plug it in anew"


def _group(path: str) -> str:
    with suppress(OSError, KeyError):
        return grp.getgrgid(os.stat(path).st_gid).gr_name
    return "dialout"


def check_tcp(host: str, port: int) -> Finding:
    """Check that the host accepts a connection, which is closed without sending a byte."""
    try:
        socket.create_connection((host, port), _CONNECT_WITHIN_S).close()
    except (OSError, OverflowError) as error:
        return Finding(
            "link", "fail",
            f"nothing answers at {host} port {port} ({error}); switch the robot on and join its network, then try "
            f"ping {host}",
        )  # fmt: skip
    return Finding("link", "pass", f"{host} port {port} takes connections")


def check_udp_port(host: str, port: int) -> Finding:
    """Check that no program on this computer receives there."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        try:
            probe.bind((host, port))
        except (OSError, OverflowError) as error:
            return Finding(
                "link", "fail", f"UDP port {port} cannot be opened ({error}); end the program that listens there"
            )
    return Finding("link", "pass", f"UDP port {port} is free for what the robot sends")


def _check_none(options: Options) -> Finding:
    return Finding("link", "pass", "a dry run without a robot")


def _check_can(options: Options) -> Finding:
    from mtm_onboard.links.robomaster_messages import BITRATE

    if find_spec("can") is None:
        return Finding("link", "fail", f"python-can is not installed; run {install_command('can')}")
    bitrate = options.get("bitrate", BITRATE)
    if bitrate != BITRATE:
        return Finding("link", "fail", f"[transport] bitrate is {bitrate}; the robot's is {BITRATE}, so correct it")
    interface, channel = options.get("interface"), str(options.get("channel", ""))
    if interface == "socketcan":
        return check_interface(channel, BITRATE)
    if interface in _SERIAL_CAN:
        # python-can takes the serial line's own rate after an @.
        return check_serial(channel.partition("@")[0])
    if interface in _VIRTUAL_CAN:
        return Finding("link", "pass", f"the CAN interface {interface} needs no adapter")
    named = interface or "that python-can's own configuration names"
    return Finding(
        "link", "warn", f"whether the CAN interface {named} is there shows only when it is opened; look at its adapter"
    )


def _check_uart(options: Options) -> Finding:
    return check_serial(str(options["port"]))


def _check_robomaster_tcp(options: Options) -> Finding:
    from mtm_onboard.links.plaintext_messages import CONTROL_PORT, PUSH_PORT

    telemetry = check_udp_port("", int(options.get("push_port", PUSH_PORT)))
    if telemetry.status == "fail":
        return telemetry
    return check_tcp(str(options["host"]), int(options.get("port", CONTROL_PORT)))


def _check_mavlink(options: Options) -> Finding:
    if find_spec("pymavlink") is None:
        return Finding("link", "fail", f"pymavlink is not installed; run {install_command('mavlink')}")
    endpoint = str(options["endpoint"])
    kind, colon, rest = endpoint.partition(":")
    if not colon:
        return check_serial(endpoint)
    host, _, number = rest.rpartition(":")
    if kind == "tcp":
        return check_tcp(host, int(number))
    if kind == "udpin":
        return check_udp_port(host, int(number))
    try:
        address = socket.gethostbyname(host)
    except OSError as error:
        return Finding("link", "fail", f"the host {host} is not known ({error}); give its IP address")
    return Finding(
        "link", "pass", f"messages go to {address} UDP port {number}; whether a vehicle receives them is not checked"
    )


_CHECKS: dict[str, Callable[[Options], Finding]] = {
    "none": _check_none,
    "robomaster-can": _check_can,
    "robomaster-uart": _check_uart,
    "robomaster-tcp": _check_robomaster_tcp,
    "mavlink": _check_mavlink,
}
