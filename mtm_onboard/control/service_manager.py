"""What systemd is told: ready, alive, stopping. The protocol is sd_notify(3): one datagram to a Unix socket."""

import contextlib
import math
import os
import socket
from collections.abc import Mapping


class ServiceManager:
    """The service manager that started this process, as its environment names it; without one nothing is sent.

    `feed` is called by the loop that must not hang, so that systemd ends the process when it does. No call waits or
    raises: a robot does not stop because nobody listens.
    """

    def __init__(self, environment: Mapping[str, str] = os.environ) -> None:
        address = environment.get("NOTIFY_SOCKET", "")
        # A leading @ stands for the zero byte of an abstract address.
        self._address = "\0" + address[1:] if address.startswith("@") else address
        self._socket = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM | socket.SOCK_NONBLOCK) if address else None
        self._feed_period_s = _watchdog_s(environment) / 4.0
        self._due_s = -math.inf

    def ready(self) -> None:
        """The robot's link is up and the loop begins."""
        self._say(b"READY=1\n")

    def feed(self, now_s: float) -> None:
        """The loop is alive; sent four times in a watchdog period."""
        if now_s >= self._due_s:
            self._due_s = now_s + self._feed_period_s
            self._say(b"WATCHDOG=1\n")

    def close(self) -> None:
        """The run has ended; safe to call more than once."""
        self._say(b"STOPPING=1\n")
        if self._socket is not None:
            self._socket.close()
            self._socket = None

    def _say(self, text: bytes) -> None:
        if self._socket is not None:
            # A full queue, or a manager that is gone; the next word may get through.
            with contextlib.suppress(OSError):
                self._socket.sendto(text, self._address)


def _watchdog_s(environment: Mapping[str, str]) -> float:
    """The period in which systemd wants to hear of this process, infinite when it does not ask."""
    asked_us = environment.get("WATCHDOG_USEC", "")
    process = environment.get("WATCHDOG_PID", str(os.getpid()))
    return int(asked_us) * 1e-6 if asked_us.isdigit() and int(asked_us) and process == str(os.getpid()) else math.inf
