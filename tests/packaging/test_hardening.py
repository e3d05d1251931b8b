"""The service's sandbox: how much it exposes, and that each link works with what it leaves."""

import re
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from hil.fleet.serial_wires import SerialWire, serial_wire
from hil.vehicles.motion_controller import MotionController
from hil.vehicles.plaintext_node import PlaintextMotionController
from hil.wires.plaintext_ports import TcpPort
from mtm_onboard.journal.journal import read_journal
from mtm_onboard.model.velocity import STOP, BodyVelocity
from mtm_onboard.protocol import Key, save_key
from mtm_onboard.runtime.client import BaseCommandClient
from tests.hil.vehicles.floating_plant import FloatingPlant
from tests.onboard.links.plaintext_rig import free_udp_port
from tests.onboard.schemes import FAKE_SECRET, small_scheme

UNIT = Path(__file__).parents[2] / "packaging/systemd/mtm-onboard@.service"
PATIENCE_S = 60.0
# Refuses memory that is writable and executable, as MemoryDenyWriteExecute=yes does, and becomes the program.
WITHOUT_WRITABLE_CODE = """
import ctypes, os, sys
PR_SET_MDWE, PR_MDWE_REFUSE_EXEC_GAIN = 65, 1
if ctypes.CDLL(None).prctl(PR_SET_MDWE, PR_MDWE_REFUSE_EXEC_GAIN, 0, 0, 0):
    sys.stderr.write("this kernel cannot refuse it\\n")
os.execvp(sys.argv[1], sys.argv[1:])
"""
CONFIG = """
[robot]
name = "r"
channel = "a"
[transport]
{transport}
[limits]
speed_mps = 1.0
turn_rate_radps = 2.0
[source]
socket = "r.base"
[control]
socket = "r.sock"
[journal]
path = "r.csv"
[realtime]
priority = 1
lock_memory = true
cpu = 0
"""

pytestmark = pytest.mark.skipif(shutil.which("systemd-analyze") is None, reason="systemd-analyze is not here")


def test_the_service_exposes_little():
    asked = ["systemd-analyze", "security", "--offline=true", "--no-pager", UNIT]
    said = subprocess.run(asked, capture_output=True, text=True).stdout
    exposure = re.search(r"Overall exposure level[^:]*: ([0-9.]+)", said)
    assert exposure, said
    assert float(exposure.group(1)) < 3.0


def test_no_dump_of_the_service_holds_the_key():
    assert "LimitCORE=0" in UNIT.read_text().splitlines()


def test_the_service_may_ask_for_the_time_and_waits_for_it():
    lines = UNIT.read_text().splitlines()
    assert {"adjtimex", "clock_adjtime"} <= allowed_calls()
    # It would deny both.
    assert not any(line.startswith("ProtectClock=") for line in lines)
    assert "CapabilityBoundingSet=" in lines
    wanted = {name for line in lines if line.startswith("Wants=") for name in line.partition("=")[2].split()}
    assert wanted == {"time-sync.target", "chrony-wait.service", "systemd-time-wait-sync.service"}
    assert any(line.startswith("After=") and "time-sync.target" in line for line in lines)


def calls_of(group: str) -> set[str]:
    """The system calls of one of systemd's groups and of those within it."""
    said = subprocess.run(
        ["systemd-analyze", "syscall-filter", group], capture_output=True, text=True, check=True
    ).stdout
    names = [line.strip() for line in said.splitlines()[1:] if line.strip() and not line.strip().startswith("#")]
    within = [calls_of(name) for name in names if name.startswith("@")]
    return {name for name in names if not name.startswith("@")}.union(*within)


def allowed_calls() -> set[str]:
    """What the unit's filter leaves."""
    allowed: set[str] = set()
    for line in UNIT.read_text().splitlines():
        if line.startswith("SystemCallFilter="):
            group = line.partition("=")[2]
            if group.startswith("~"):
                allowed -= calls_of(group[1:])
            else:
                allowed |= calls_of(group) if group.startswith("@") else set(group.split())
    return allowed


def ticks_kept(journal: Path) -> int:
    return sum(line[:1].isdigit() for line in journal.read_text().splitlines()) if journal.exists() else 0


def robot(link: str) -> SerialWire:
    plant = FloatingPlant()
    if link == "none":
        controller = MotionController(plant)
        return SerialWire('kind = "none"', controller, lambda now_s: None, lambda: 0, lambda: None)
    if link == "tcp":
        port = TcpPort(push_port=free_udp_port())
        node = PlaintextMotionController(MotionController(plant, deadman_s=None), [port])
        transport = f'kind = "robomaster-tcp"\nhost = "127.0.0.1"\nport = {port.port}\npush_port = {port._push_port}'
        return SerialWire(transport, node.controller, node.poll, lambda: node.faults, node.shutdown)
    return serial_wire(link, plant)


@pytest.mark.realtime
@pytest.mark.skipif(shutil.which("strace") is None, reason="strace is not here")
@pytest.mark.parametrize("link", ["none", "can", "plaintext", "tcp", "mavlink"])
def test_each_link_drives_with_the_calls_the_service_may_make(tmp_path, link):
    wire = robot(link)
    save_key(Key("fake-key", FAKE_SECRET, small_scheme()), tmp_path / "r.key")
    (tmp_path / "robot.toml").write_text(CONFIG.format(transport=wire.transport))
    program = [sys.executable, "-m", "mtm_onboard", "run", "--config", "robot.toml", "--key", "r.key", "--message", "7"]
    traced = ["strace", "-f", "-qq", "-o", "trace", sys.executable, "-c", WITHOUT_WRITABLE_CODE, *program]
    process = subprocess.Popen(traced, cwd=tmp_path, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    client = BaseCommandClient(tmp_path / "r.base")
    journal, moved, enough, began_s = tmp_path / "r.csv", 0, False, time.monotonic()
    while not enough and process.poll() is None and time.monotonic() - began_s < PATIENCE_S:
        moved += client.send(BodyVelocity(0.1, 0.0, 0.0)) and (link == "none" or wire.controller.demand != STOP)
        wire.poll(time.monotonic() - began_s)
        # A traced program on a busy machine misses many of its ticks.
        enough = moved >= 50 and ticks_kept(journal) >= 20
        time.sleep(0.01)
    program_id = int((tmp_path / "trace").read_text().split(maxsplit=1)[0])
    subprocess.run(["kill", f"-{signal.SIGTERM.value}", str(program_id)], check=True)
    while process.poll() is None and time.monotonic() - began_s < PATIENCE_S:
        wire.poll(time.monotonic() - began_s)
        time.sleep(0.01)
    _, error = process.communicate(timeout=20)
    client.close()
    wire.shutdown()
    assert process.returncode == 0, error
    assert "cannot refuse" not in error
    assert moved >= 50
    assert len(read_journal(journal).ticks) >= 20
    made = set(re.findall(r"^\d+ +(?:<\.\.\. )?([a-z0-9_]+)", (tmp_path / "trace").read_text(), re.MULTILINE))
    assert {"sched_setscheduler", "execve", "mlockall"} <= made
    assert made - allowed_calls() == set()
