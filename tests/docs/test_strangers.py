"""A stranger's first hour, for each of the three users: the pages' commands in a clean folder, and what they print."""

import re
import shlex
import shutil
import signal
import subprocess
import sys
from pathlib import Path

import pytest

from mtm_onboard.firmware.image import parse_image
from tests.command_lines import PACKAGES, PROGRAMS, Command
from tests.patience import PATIENCE_S

ROOT = Path(__file__).parents[2]
README = (ROOT / "README.md").read_text(encoding="utf-8")
ON_A_ROBOT = (ROOT / "docs" / "onboard.md").read_text(encoding="utf-8")
FIRMWARE = (ROOT / "firmware_shim" / "README.md").read_text(encoding="utf-8")


def lines_of(page: str, heading: str) -> list[str]:
    """The commands of ours in a section of a page, in order."""
    section = page.partition(f"## {heading}\n")[2].partition("\n## ")[0]
    lines = re.findall(rf"^ *((?:{'|'.join(PROGRAMS)}) [^`\n]*)$", section, re.MULTILINE)
    return [shlex.join(shlex.split(line, comments=True)) for line in lines]


@pytest.fixture
def typed(tmp_path, monkeypatch, capsys):
    """Type a command line in a clean folder: its exit code and what it prints."""
    monkeypatch.chdir(tmp_path)

    def run(line: str) -> tuple[int, str]:
        program, *arguments = shlex.split(line)
        assert program in PACKAGES
        code = Command(program, ()).run(*arguments)
        return code, "".join(capsys.readouterr())

    return run


def masked(text: str) -> list[str]:
    """The words of each line without its numbers, tables' columns closed up."""
    lines = [" ".join(re.sub(r"-?\d[\d.,]*(?![0-9a-f]*\))", "#", line).split()) for line in text.strip().splitlines()]
    return [line for line in lines if line]


@pytest.mark.realtime
def test_a_roboticist_comes_from_a_key_to_a_running_robot(typed, tmp_path):
    lines = lines_of(ON_A_ROBOT, "From a key to a moving robot")
    assert [line.split()[1] for line in lines[:6]] == ["keygen", "issue", "issue", "show", "doctor", "run"]
    for line, says in zip(
        lines[:4], ("wrote master lab", "for the robot of robot0", "for an auditor", "robot0"), strict=True
    ):
        code, text = typed(line)
        assert code == 0, text
        assert says in text
    assert {path.name: path.stat().st_mode & 0o777 for path in tmp_path.iterdir()} == dict.fromkeys(
        ("lab.master", "robot.key", "auditor.key"), 0o600
    )
    shutil.copy(ROOT / "examples" / "robots" / "none.toml", "robot.toml")
    code, text = typed(f"{lines[4]} --seconds 1")
    marks = [line.split()[0] for line in text.splitlines()]
    assert set(marks) <= {"pass", "warn", "fail"}
    assert code == ("fail" in marks)
    told, ended = ran_until(lines[5], "base command has come yet")
    printed = ON_A_ROBOT.partition("who sends them, the message, a stop.")[2].partition("4.  ")[0]
    expected = re.findall(r"^ *mtm-onboard: (.*)$", printed, re.MULTILINE)
    # The page's last line, that the message begins, comes with the next slot.
    for sentence in expected[:-1]:
        assert any(masked(sentence) == masked(line.removeprefix("mtm-onboard: ")) for line in told), (sentence, told)
    assert "ticks" in ended or "sent" in ended


def ran_until(line: str, words: str) -> tuple[list[str], str]:
    """Run it, as its own refusal advises where nobody keeps this clock right, until it says so; then Ctrl-C."""
    program, *arguments = shlex.split(line)
    command = [sys.executable, "-m", PACKAGES[program], *arguments, "--allow-unsynchronised"]
    with subprocess.Popen(
        command, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL),
    ) as running:  # fmt: skip
        assert running.stderr is not None
        told: list[str] = []
        for text in running.stderr:
            told.append(text.rstrip())
            if words in text:
                break
        running.send_signal(signal.SIGINT)
        out, err = running.communicate(timeout=PATIENCE_S)
    return [*told, *err.splitlines()], out


@pytest.mark.long
def test_an_auditor_reads_what_the_first_page_shows(typed, tmp_path):
    (line,) = lines_of(README, "One decode")
    assert line == "mtm-audit decode recording.mp4 --key robot.key"
    for made in ("robot", "other"):
        assert typed(f"mtm-onboard keygen --preset paper-robomaster-fleet --id {made} --out {made}.key")[0] == 0
    assert typed("mtm-hil record --out made --message 178 --key robot.key --seconds 15")[0] == 0
    shutil.copy(tmp_path / "made" / "video.mp4", "recording.mp4")
    code, text = typed(line)
    shown = README.partition(line)[2].partition("```\n")[2].partition("```")[0]
    assert code == 0
    assert text.splitlines()[:3] == shown.splitlines()[:3]
    assert masked(" ".join(text.split())) == masked(" ".join(shown.split()))
    code, text = typed("mtm-audit decode made/mocap --key other.key")
    assert code == 3
    assert text.startswith("absent: no message of key other was found in this recording\n")


def test_a_firmware_person_makes_images_for_a_board(typed, tmp_path):
    fixed, rolling, device, sealed = lines_of(FIRMWARE, "Make an image")
    assert typed("mtm-onboard keygen --preset paper-robomaster-fleet --id old --out robot.key")[0] == 0
    code, text = typed(fixed)
    assert code == 0
    assert "1 message(s) in 12 s, again and again, 50 Hz" in text
    image = parse_image((tmp_path / "image.bin").read_bytes())
    assert (image.samples.shape[1], image.repeats, (tmp_path / "image.bin").stat().st_size) == (600, True, 2492)
    (tmp_path / "robot.key").unlink()
    assert typed("mtm-onboard keygen --preset robomaster-fleet --id lab --out lab.master")[0] == 0
    assert typed("mtm-onboard issue --master lab.master --channel robot0 --out robot.key")[0] == 0
    for line, says in ((rolling, "50 message(s) in 600 s from slot"), (device, "wrote a device key"),
                       (sealed, "50 message(s) in 600 s")):  # fmt: skip
        code, text = typed(line)
        assert (code, says in text) == (0, True), text
    assert (tmp_path / "image.bin").read_bytes().startswith(b"MTMS")
