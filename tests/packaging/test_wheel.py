"""Wheel and sdist as a user gets them: built, checked, and installed with each extra in a clean environment."""

import json
import re
import shutil
import subprocess
import sys
import tarfile
import tomllib
import venv
import zipfile
from email import message_from_bytes
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
EXTRAS = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]["optional-dependencies"]
PROGRAMS = {"mtm-onboard": "mtm_onboard", "mtm-audit": "mtm_audit", "mtm-hil": "hil"}
# What each extra brings that can be imported; those that are not here are what a program needs.
LIBRARIES = {
    "can": ["can"],
    "serial": ["serial"],
    "mavlink": ["pymavlink"],
    "logs": ["ezc3d", "mcap", "mcap_protobuf", "pymavlink", "pyulog", "rosbags"],
    "live": ["aiohttp"],
    "parquet": ["pyarrow"],
    "cluster": ["distributed"],
    "worlds": ["vmas", "mujoco", "Box2D"],
}
COMPLETE = ("audit", "live", "logs", "parquet", "cluster", "hil", "worlds")

pytestmark = pytest.mark.long


def run(*command, code=0):
    done = subprocess.run(list(map(str, command)), capture_output=True, text=True, check=False, cwd="/")
    assert done.returncode == code, done.stdout + done.stderr
    return done


def refuses(program, *command):
    """One sentence that says what to install."""
    said = run(*command, code=1).stderr
    assert re.fullmatch(rf"{program}: .* not installed; install it with: pip install '.*'\n", said)


@pytest.fixture(scope="module")
def built(tmp_path_factory):
    """The wheel, made from the sdist, and the sdist."""
    folder = tmp_path_factory.mktemp("dist")
    run(sys.executable, "-m", "build", "--no-isolation", "--outdir", folder, ROOT)
    (wheel,), (sdist,) = folder.glob("*.whl"), folder.glob("*.tar.gz")
    return wheel, sdist


@pytest.fixture(scope="module")
def pins(tmp_path_factory):
    """The versions that the project is tested with, so that tomorrow's releases do not fail today's test."""
    lines = (ROOT / "constraints/worlds.txt").read_text().splitlines()
    (torch,) = re.findall(r"^TORCH := (\S+)$", (ROOT / "Makefile").read_text(), re.MULTILINE)
    path = tmp_path_factory.mktemp("pins") / "pins.txt"
    path.write_text("\n".join([torch, *(line.rstrip("\\") for line in lines if re.match(r"[a-zA-Z]", line))]))
    return path


@pytest.fixture(scope="module")
def recording(tmp_path_factory):
    """A folder with motion capture of four robots that say 178, and the key."""
    folder = tmp_path_factory.mktemp("recording") / "recording"
    programs, key = Path(sys.executable).parent, folder.with_name("robot.key")
    # Of the fixed schedule, so that nobody needs to say when it was made.
    run(programs / "mtm-onboard", "keygen", "--preset", "paper-robomaster-fleet", "--id", "fake", "--out", key)
    told = ("--message", "178", "--seconds", "26", "--wire", "direct", "--no-video")
    run(programs / "mtm-hil", "record", "--out", folder, "--key", key, *told)
    key.rename(folder / "robot.key")
    return folder


def test_the_index_would_take_both(built):
    run(sys.executable, "-m", "twine", "check", "--strict", *built)


def test_the_wheel_holds_packages_types_and_the_licence(built):
    wheel, sdist = built
    with zipfile.ZipFile(wheel) as archive:
        names = set(archive.namelist())
    tops = {name.partition("/")[0] for name in names}
    (information,) = tops - {"mtm_onboard", "mtm_audit", "hil"}
    assert information.endswith(".dist-info")
    assert {f"{package}/py.typed" for package in PROGRAMS.values()} <= names
    assert f"{information}/licenses/LICENSE" in names
    ours = {
        str(path.relative_to(ROOT))
        for package in PROGRAMS.values()
        for path in (ROOT / package).rglob("*")
        if path.is_file() and path.suffix != ".pyc"
    }
    assert {name for name in names if not name.startswith(information)} == ours
    with tarfile.open(sdist) as archive:
        inside = {name.partition("/")[2] for name in archive.getnames()}
    assert {"LICENSE", "Makefile", "firmware_shim/src/guard.c", "constraints/dev.txt"} <= inside


def test_both_carry_the_same_version_and_all_extras(built):
    wheel, sdist = built
    with zipfile.ZipFile(wheel) as archive:
        (path,) = [name for name in archive.namelist() if name.endswith(".dist-info/METADATA")]
        metadata = message_from_bytes(archive.read(path))
    assert set(metadata.get_all("Provides-Extra")) == set(EXTRAS)
    assert sdist.name == f"messages_through_motion-{metadata['Version']}.tar.gz"


def test_a_folder_that_is_no_clone_builds_too(built, tmp_path):
    _, sdist = built
    with tarfile.open(sdist) as archive:
        archive.extractall(tmp_path, filter="data")
    (folder,) = tmp_path.iterdir()
    (folder / "PKG-INFO").unlink()
    shutil.rmtree(folder / "messages_through_motion.egg-info")
    run(sys.executable, "-m", "build", "--no-isolation", "--wheel", "--outdir", tmp_path, folder)
    assert list(tmp_path.glob("messages_through_motion-0.0-*.whl"))


@pytest.mark.parametrize("extra", ["", *(extra for extra in EXTRAS if extra != "dev")])
def test_a_clean_environment_gets_what_the_extra_promises(built, pins, recording, tmp_path, extra):
    wheel, _ = built
    venv.create(tmp_path / "venv", with_pip=True)
    bin_folder = tmp_path / "venv/bin"
    python = bin_folder / "python"
    wanted = f"{wheel}[{extra}]" if extra else wheel
    run(python, "-m", "pip", "install", "--quiet", "--disable-pip-version-check", "-c", pins, wanted)
    run(python, "-m", "pip", "check")
    run(python, "-c", f"import {', '.join([*PROGRAMS.values(), *LIBRARIES.get(extra, [])])}")
    assert "Usage: mtm-onboard" in run(bin_folder / "mtm-onboard", "--help").stdout
    for program in ("mtm-audit", "mtm-hil"):
        if extra in COMPLETE:
            assert f"Usage: {program}" in run(bin_folder / program, "--help").stdout
        else:
            refuses(program, bin_folder / program, "--help")
    if extra == "audit":
        record = ("record", "--out", tmp_path / "new", "--message", "1", "--seconds", "26", "--wire", "can")
        refuses("mtm-hil", bin_folder / "mtm-hil", *record)
    if extra in COMPLETE:
        key = recording / "robot.key"
        report = run(bin_folder / "mtm-audit", "decode", recording / "mocap", "--key", key, "--json")
        assert json.loads(report.stdout)["message"] == 178
