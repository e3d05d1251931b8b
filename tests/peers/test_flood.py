"""Floods of base commands: no stop is lost, and the loop keeps its ticks. Loopback only, each flood for two seconds."""

import signal
import socket
import sys
import time
from pathlib import Path

import numpy as np
import pytest

from mtm_onboard.journal.journal import read_journal
from mtm_onboard.model.velocity import BodyVelocity
from mtm_onboard.protocol import Key, save_key
from mtm_onboard.runtime.client import BaseCommandClient
from mtm_onboard.runtime.guard import STOPPED
from tests.onboard.schemes import FAKE_SECRET, small_scheme
from tests.peers.conftest import until

pytestmark = [pytest.mark.peer, pytest.mark.realtime]

FLOODS = 20
# Sends base commands at a rate for two seconds, as a controller that has gone wrong would, and says how many.
FLOOD = """
import socket, sys, time
where, rate_hz, seconds = sys.argv[1], 35_000, 2.0
sender = socket.socket(socket.AF_UNIX if "/" in where else socket.AF_INET, socket.SOCK_DGRAM)
address = where if "/" in where else ("127.0.0.1", int(where))
began_s, sent = time.monotonic(), 0
while (passed_s := time.monotonic() - began_s) < seconds:
    for _ in range(max(0, min(int(passed_s * rate_hz) - sent, 100))):
        sender.sendto(b"v 0.1 0 0", address)
        sent += 1
print(sent, flush=True)
"""
CONFIG = """
[robot]
name = "r"
channel = "a"
[transport]
kind = "none"
[limits]
speed_mps = 1.0
turn_rate_radps = 2.0
[source]
{source}
[journal]
path = "{folder}/r.csv"
[realtime]
priority = 20
"""


@pytest.mark.parametrize("kind", ["unix", "udp"])
def test_of_twenty_floods_none_loses_a_stop_and_hardly_a_tick(start, tmp_path, kind):
    save_key(Key("fake-key", FAKE_SECRET, small_scheme()), tmp_path / "r.key")
    stopped, missed, sent, reasons = [], [], [], []
    for number in range(FLOODS):
        folder = tmp_path / str(number)
        folder.mkdir()
        report = flooded(start, folder, tmp_path / "r.key", kind)
        for column, value in zip((stopped, missed, sent, reasons), report, strict=True):
            column.append(value)
    told = reasons.count("the operator said stop")
    print(f"\n{kind}: {sum(stopped)} of {FLOODS} stopped, {told} as told, missed ticks {missed}, datagrams {sent}")
    assert all(stopped)
    assert max(missed) <= 1
    # A socket makes the sender wait; a port takes all that it is sent.
    assert kind == "unix" or min(sent) > 35_000


def flooded(start, folder: Path, key: Path, kind: str) -> tuple[bool, int, int, str]:
    """Whether a stop in a flood's middle was obeyed, the ticks that were missed, what was sent, and why it stopped."""
    where = folder / "r.base" if kind == "unix" else free_port()
    source = f'socket = "{where}"' if kind == "unix" else f'kind = "udp"\nport = {where}'
    (folder / "robot.toml").write_text(CONFIG.format(source=source, folder=folder))
    options = ("--config", folder / "robot.toml", "--key", key, "--message", 7)
    run = start(sys.executable, "-m", "mtm_onboard", "run", *options)
    run.wait_for("no base command has come yet")
    operator = BaseCommandClient(where)
    flood = start(sys.executable, "-c", FLOOD, where)
    time.sleep(1.0)
    operator.stop()
    assert flood.end() == 0, flood.output
    until(lambda: "stands still until the run is started anew" in run.output, 5.0)
    # Base commands go on, and move nothing.
    for _ in range(10):
        operator.send(BodyVelocity(0.1, 0.0, 0.0))
        time.sleep(0.02)
    run.signal(signal.SIGINT)
    assert run.end() == 0, run.output
    operator.close()
    record = read_journal(folder / "r.csv")
    obeyed = bool(record.flags[-1] & STOPPED) and not record.sent[-1].any()
    reason = run.wait_for("stands still until").removeprefix("mtm-onboard: ").partition(":")[0]
    return obeyed, int(np.sum(np.diff(record.ticks) - 1)), int(flood.lines[-1]), reason


def free_port() -> int:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        probe.bind(("127.0.0.1", 0))
        return int(probe.getsockname()[1])
