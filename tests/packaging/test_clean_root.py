"""Installs the package into a clean Debian and drives a simulated robot there; `make deb-test`.

Needs root, debootstrap and a network, and a minute or two. MTM_CLEAN_ROOT_DIR names a folder for the Debian, which is
then kept and used again; nothing is mounted, and the package is purged from it at the end.
"""

import json
import os
import shutil
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest

from mtm_onboard.journal.journal import read_journal
from mtm_onboard.protocol import load_key
from mtm_onboard.protocol.journal_noise import with_noise
from mtm_onboard.runtime.guard import NOISE
from mtm_onboard.runtime.message import message_of
from mtm_onboard.runtime.modulator import Modulator

ROOT = Path(__file__).parents[2]
PACKAGES = "python3,python3-numpy,python3-can,python3-serial,adduser,iproute2"
HOME = "var/lib/mtm"
KEYGEN = ("--id", "clean", "--preset", "paper-robomaster-fleet", "--message-ticks", "30", "--band", "2:20")
FIRST, SECOND = 178, 27
CONFIG = """
[robot]
name = "robot0"
channel = "robot0"
[transport]
kind = "none"
[limits]
speed_mps = 1.0
turn_rate_radps = 2.0
[source]
socket = "/var/lib/mtm/robot0.base"
[control]
socket = "/var/lib/mtm/robot0.sock"
[journal]
path = "/var/lib/mtm/robot0.journal"
"""

pytestmark = [
    pytest.mark.skipif(os.environ.get("MTM_CLEAN_ROOT") != "1", reason="only when asked for; run make deb-test"),
    pytest.mark.skipif(shutil.which("debootstrap") is None, reason="debootstrap is not here"),
    pytest.mark.realtime,
    pytest.mark.long,
]


@pytest.fixture(scope="module")
def debian(tmp_path_factory):
    """The folder of a Debian bookworm with what the package depends on, and nothing of ours."""
    given = os.environ.get("MTM_CLEAN_ROOT_DIR")
    folder = tmp_path_factory.mktemp("debian") if given is None else Path(given).resolve()
    assert folder != Path("/")
    if not (folder / "usr/bin/python3").exists():
        include = f"--include={PACKAGES}"
        subprocess.run(["debootstrap", "--variant=minbase", include, "bookworm", folder], check=True)
        # Else no user but root gets into it when the folder was made for one user alone.
        folder.chmod(0o755)
    shutil.rmtree(folder / HOME, ignore_errors=True)
    yield folder
    if given is None:
        shutil.rmtree(folder)


@pytest.fixture(scope="module")
def robot(debian, tmp_path_factory):
    """That Debian with the package and one robot's configuration and key."""
    folder = tmp_path_factory.mktemp("deb")
    subprocess.run([sys.executable, ROOT / "packaging/build_deb.py", folder], check=True, stdout=subprocess.DEVNULL)
    (built,) = folder.glob("mtm-onboard_*_all.deb")
    shutil.copy(built, debian / "tmp/mtm-onboard.deb")
    as_root(debian, "dpkg", "--install", "/tmp/mtm-onboard.deb")
    (debian / HOME / "robot0.toml").write_text(CONFIG)
    as_robot(debian, "keygen", *KEYGEN, "--out", f"/{HOME}/robot0.key")
    yield debian
    if (debian / "usr/bin/mtm-onboard").exists():
        as_root(debian, "dpkg", "--purge", "mtm-onboard")


def as_root(debian: Path, *command: str) -> str:
    """What a command of that Debian prints; a failure is one here too."""
    return subprocess.run(["chroot", debian, *command], check=True, stdout=subprocess.PIPE, text=True).stdout


def robot_command(debian: Path, *arguments: str) -> list[str | Path]:
    """`mtm-onboard` there, as the user that the service runs as."""
    return ["chroot", "--userspec=mtm:mtm", debian, "/usr/bin/mtm-onboard", *arguments]


def as_robot(debian: Path, *arguments: str) -> str:
    """What `mtm-onboard` prints there."""
    return subprocess.run(robot_command(debian, *arguments), check=True, stdout=subprocess.PIPE, text=True).stdout


def files(*more: str) -> list[str]:
    return ["--config", f"/{HOME}/robot0.toml", "--key", f"/{HOME}/robot0.key", *more]


def test_it_runs_on_the_libraries_that_debian_has(robot):
    program = "import mtm_onboard.control.session, numpy, sys; print(numpy.__version__, mtm_onboard.__file__)"
    version, place = as_root(robot, "python3", "-c", program).split()
    print(f"\nDebian's numpy is {version}")
    assert place.startswith("/usr/lib/python3/dist-packages/")


def test_the_doctor_finds_a_robot_in_order(robot):
    command = robot_command(robot, "doctor", *files("--seconds", "2", "--json"))
    found = subprocess.run(command, stdout=subprocess.PIPE, text=True)
    checks = {check["check"]: check["status"] for check in json.loads(found.stdout)["checks"]}
    # The host of a clean Debian may be busy and have a clock that nobody sets.
    host = {"clock", "processors", "loop"}
    assert {status for check, status in checks.items() if check not in host} == {"pass"}
    assert found.returncode == ("fail" in checks.values())


def test_a_robot_says_two_messages_and_keeps_a_journal(robot):
    command = robot_command(robot, "run", *files("--stdin", "--message", str(FIRST), "--duration", "3"))
    with subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True) as run:
        try:
            drive(run, 1.0)
            answer = as_robot(robot, "send", "--config", f"/{HOME}/robot0.toml", "--message", str(SECOND))
            drive(run, 10.0)
            said, _ = run.communicate()
        finally:
            run.kill()
    assert run.returncode == 0
    assert "ticks sent" in said
    assert answer.startswith(f"message 1, number {SECOND}, begins at")
    check_journal(robot)
    assert not (robot / HOME / "robot0.sock").exists()


def drive(run: subprocess.Popen[str], seconds: float) -> None:
    """Give base commands at 50 Hz for so long, or until the run ends."""
    end_s = time.monotonic() + seconds
    while run.poll() is None and time.monotonic() < end_s:
        try:
            run.stdin.write("v 0.3 0 0.1\n")
            run.stdin.flush()
        except BrokenPipeError:
            return
        time.sleep(0.02)


def check_journal(robot: Path) -> None:
    """What Debian's numpy made of the key is what the one here makes of it."""
    key = load_key(robot / HOME / "robot0.key")
    record = with_noise(read_journal(robot / HOME / "robot0.journal"), key)
    (event,) = [event for event in record.events if "message 1 begins" in event.text]
    first, second = (
        Modulator(key.codebook(), "robot0", message_of(number, key, place))
        for place, number in ((0, FIRST), (1, SECOND))
    )
    calm = record.flags == NOISE
    ticks = record.ticks[calm]
    assert event.tick % 30 == 0
    assert np.sum(ticks < event.tick) > 10
    assert np.sum(ticks >= event.tick) > 10
    noise = [(second if tick >= event.tick else first).perturbation(tick) for tick in ticks.tolist()]
    assert record.noise[calm, :2] == pytest.approx(0.1 * np.array(noise), abs=1e-6)


def test_removed_it_leaves_journals_and_purged_no_keys(robot):
    (robot / "etc/mtm/robot1.key").touch(mode=0o600)
    as_root(robot, "dpkg", "--remove", "mtm-onboard")
    assert (robot / "etc/mtm/robot1.key").exists()
    assert not (robot / "usr/bin/mtm-onboard").exists()
    as_root(robot, "dpkg", "--purge", "mtm-onboard")
    assert not (robot / "etc/mtm").exists()
    assert (robot / HOME / "robot0.journal").exists()
