import argparse
import re
import select
import signal
import stat
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest

from mtm_onboard.cli import main, parser_of
from mtm_onboard.journal.journal import read_journal
from mtm_onboard.model.velocity import BodyVelocity
from mtm_onboard.protocol import load_key
from mtm_onboard.protocol.framing import symbols_of_number
from mtm_onboard.protocol.journal_noise import with_noise
from mtm_onboard.runtime.client import BaseCommandClient
from mtm_onboard.runtime.guard import NOISE
from mtm_onboard.runtime.modulator import Modulator
from tests.patience import PATIENCE_S


def choices_of(parser):
    """The commands that a parser knows."""
    return next(action.choices for action in parser._actions if isinstance(action, argparse._SubParsersAction))


CONFIG = """
[robot]
name = "robot0"
channel = "robot1"
[transport]
kind = "none"
[limits]
speed_mps = 1.0
turn_rate_radps = 2.0
[source]
socket = "{source}"
[journal]
path = "{journal}"
"""
TOLD = """\
mtm-onboard: key fake-key is of format 1: whoever has it can read and forge the messages of all robots and days; \
mtm-onboard keygen and issue make keys of format 2
mtm-onboard: robot0 plays channel robot1 of scheme robomaster-fleet (0123) with key fake-key: silence
mtm-onboard: base commands come from the socket HERE/r.base and go to none
mtm-onboard: to stop the robot: the datagram stop to the socket HERE/r.base; Ctrl-C ends the run
mtm-onboard: the link is up
mtm-onboard: no base command has come yet: the robot stands still
mtm-onboard: base commands come from process N
"""


def keygen(path: Path, *options: str) -> int:
    return main(["keygen", "--id", "fake-key", "--out", str(path), *options])


@pytest.fixture
def key(tmp_path):
    assert keygen(tmp_path / "robot.key", "--preset", "paper-robomaster-fleet") == 0
    return tmp_path / "robot.key"


def configure(folder: Path) -> None:
    (folder / "robot.toml").write_text(CONFIG.format(source=folder / "r.base", journal=folder / "journal.csv"))


def run(folder: Path, *options: str) -> int:
    return main(["run", "--config", str(folder / "robot.toml"), "--key", str(folder / "robot.key"), *options])


def start(folder: Path, *options: str) -> subprocess.Popen[bytes]:
    command = [sys.executable, "-c", "import sys; from mtm_onboard.cli import main; sys.exit(main())", "run"]
    files = ["--config", str(folder / "robot.toml"), "--key", str(folder / "robot.key")]
    return subprocess.Popen(
        [*command, *files, *options], stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.PIPE
    )


def test_the_fleet_preset_is_the_documented_scheme(key):
    scheme = load_key(key).scheme
    assert (scheme.rate_hz, scheme.band_hz, scheme.alphabet_size, scheme.message_ticks) == (50.0, (0.5, 5.0), 4, 600)
    assert [(each.name, each.body, each.axes, each.symbols, each.sigma) for each in scheme.channels] == [
        (name, name, ("vx", "vy"), 1, 0.1) for name in ("robot0", "robot1", "robot2", "robot3")
    ]
    assert (scheme.combine, scheme.power, scheme.schedule) == ("split", "window", "fixed")
    assert stat.S_IMODE(key.stat().st_mode) == 0o600


def test_every_parameter_can_be_chosen(tmp_path):
    code = keygen(
        tmp_path / "a.key", "--name", "arms", "--rate", "20", "--band", "0.5:4", "--alphabet", "8",
        "--message-ticks", "400", "--channel", "inner:shoulder,elbow:2:0.3:arm", "--channel", "base:vx:2:0.1",
        "--combine", "same", "--power", "ensemble", "--schedule", "rolling", "--check", "none",
    )  # fmt: skip
    scheme = load_key(tmp_path / "a.key").scheme
    assert code == 0
    assert scheme.channels[0].body == "arm"
    assert scheme.channels[0].axes == ("shoulder", "elbow")
    assert (scheme.name, scheme.rate_hz, scheme.band_hz, scheme.message_symbols) == ("arms", 20.0, (0.5, 4.0), 2)
    assert (scheme.combine, scheme.power, scheme.schedule) == ("same", "ensemble", "rolling")


def test_an_option_overrides_its_part_of_a_preset(tmp_path):
    assert keygen(tmp_path / "a.key", "--preset", "paper-robomaster-fleet", "--alphabet", "16") == 0
    assert load_key(tmp_path / "a.key").scheme.alphabet_size == 16


def test_show_tells_the_scheme_and_never_the_secret(key, capsys):
    assert main(["show", "--key", str(key)]) == 0
    shown = capsys.readouterr().out
    for fact in (
        load_key(key).scheme.fingerprint,
        "fake-key",
        "600 ticks, 12 s, 4 symbols",
        "number of 8 bits",
        "55 tones",
    ):
        assert fact in shown
    assert load_key(key).secret.hex() not in shown


@pytest.mark.parametrize(
    ("options", "sentence"),
    [
        (["--preset", "paper-robomaster-fleet", "--band", "0.5:30"], "lower band_hz or raise rate_hz"),
        (["--preset", "paper-robomaster-fleet", "--channel", "robot0"], "NAME:AXES:SYMBOLS:SIGMA"),
        (["--preset", "paper-robomaster-fleet", "--schedule", "weekly"], "choose one of: fixed, rolling"),
    ],
)
def test_a_scheme_that_cannot_be_is_an_error_of_one_sentence(tmp_path, capsys, options, sentence):
    assert keygen(tmp_path / "a.key", *options) == 2
    error = capsys.readouterr().err
    assert error.startswith("mtm-onboard: ")
    assert error.count("\n") == 1
    assert sentence in error
    assert not (tmp_path / "a.key").exists()


def test_a_key_is_never_overwritten(key, capsys):
    before = key.read_bytes()
    assert keygen(key, "--preset", "paper-robomaster-fleet") == 1
    assert key.read_bytes() == before
    assert "exists already" in capsys.readouterr().err


@pytest.mark.parametrize(
    "arguments",
    [
        ["fly"], ["keygen", "--id", "a", "--out", "b"], ["run", "--config", "a", "--key", "b"],
        ["run", "--config", "a", "--key", "b", "--message", "1", "--no-message"],
        ["run", "--config", "a", "--key", "b", "--message", "1", "--duration", "-1"],
        ["run", "--config", "a", "--key", "b", "--symbols", "one"],
    ],
)  # fmt: skip
def test_wrong_usage_leaves_with_two(arguments, capsys):
    with pytest.raises(SystemExit) as left:
        main(arguments)
    assert left.value.code == 2
    assert capsys.readouterr().err.startswith("Usage: mtm-onboard")


@pytest.mark.parametrize(
    ("options", "sentence"),
    [(["--message", "256"], "does not fit"), (["--symbols", "0,1"], "has 4"), (["--symbols", "0,1,2,4"], "alphabet")],
)
def test_a_message_that_does_not_fit_is_refused(tmp_path, key, capsys, options, sentence):
    configure(tmp_path)
    assert run(tmp_path, *options) == 1
    assert sentence in capsys.readouterr().err


def test_a_run_to_a_message_s_end_sends_it_and_says_so(tmp_path, key, capsys):
    configure(tmp_path)
    assert run(tmp_path, "--message", "99", "--duration", "0.1") == 0
    assert re.fullmatch(
        r"\d+ ticks sent, 0 unsent, \d+ missed, \d+ over their period, 0 clamped, \d+ stale, 0 link losses, "
        r"0 times degraded, 0 commands refused, "
        r"late p50 [\d.]+ ms p99 [\d.]+ ms, journal .*journal.csv, 0 rows lost\n",
        capsys.readouterr().out,
    )
    header = read_journal(tmp_path / "journal.csv").header
    loaded = load_key(key)
    assert (header.key_id, header.fingerprint) == ("fake-key", loaded.scheme.fingerprint)
    assert header.symbols == symbols_of_number(99, loaded.scheme)
    assert loaded.secret.hex() not in (tmp_path / "journal.csv").read_text()


def test_a_start_in_the_past_is_refused_before_anything_moves(tmp_path, key, capsys):
    configure(tmp_path)
    for start in (str(time.time() - 5.0), "5"):
        assert run(tmp_path, "--message", "99", "--start-at", start) == 1
        error = capsys.readouterr().err
        assert "in the past" in error
        assert error.count("\n") == 1
    assert not (tmp_path / "journal.csv").exists()


def test_robots_that_are_told_the_same_start_share_it(tmp_path, key):
    configure(tmp_path)
    start = time.time() + 1.0
    assert run(tmp_path, "--message", "99", "--start-at", str(start), "--duration", "0.1") == 0
    record = read_journal(tmp_path / "journal.csv")
    assert record.header.start_unix_s == pytest.approx(start)
    assert record.ticks[0] < 0


@pytest.mark.realtime
def test_lines_on_standard_input_become_motion(tmp_path, key):
    configure(tmp_path)
    process = start(tmp_path, "--symbols", "3,1,0,2", "--stdin")
    assert process.stdin is not None
    while process.poll() is None and not noisy_ticks(tmp_path):
        process.stdin.write(b"v 0.2 0 0.1\n")
        process.stdin.flush()
        select.select([], [], [], 0.02)
    process.send_signal(signal.SIGTERM)
    out, error = process.communicate(timeout=PATIENCE_S)
    assert process.returncode == 0
    assert out.count(b"\n") == 1
    assert all(line.startswith(b"mtm-onboard: ") for line in error.splitlines())
    assert noisy_ticks(tmp_path) > 0
    record = with_noise(read_journal(tmp_path / "journal.csv"), load_key(key))
    noisy = record.flags == NOISE
    own = Modulator(load_key(key).codebook(), "robot1", (1,))
    base = BodyVelocity(0.2, 0.0, 0.1)
    assert record.sent[noisy] == pytest.approx(np.array([own.add(tick, base) for tick in record.ticks[noisy].tolist()]))


def noisy_ticks(folder: Path) -> int:
    path = folder / "journal.csv"
    # The first look may come before the header is written.
    if not path.exists() or path.read_text().count("\n") < 3:
        return 0
    return int(np.count_nonzero(read_journal(path).flags == NOISE))


@pytest.mark.realtime
def test_an_interrupt_ends_a_controller_s_run_with_nothing_wrong(tmp_path, key):
    configure(tmp_path)
    process = start(tmp_path, "--no-message")
    client = BaseCommandClient(tmp_path / "r.base")
    journal = tmp_path / "journal.csv"
    while process.poll() is None and (not journal.exists() or b",0.2,0," not in journal.read_bytes()):
        client.send(BodyVelocity(0.2, 0.0, 0.1))
        select.select([], [], [], 0.02)
    # As long as the run may take to say so.
    for _ in range(20):
        client.send(BodyVelocity(0.2, 0.0, 0.1))
        select.select([], [], [], 0.02)
    process.send_signal(signal.SIGINT)
    out, error = process.communicate(timeout=PATIENCE_S)
    client.close()
    assert process.returncode == 0
    assert b"ticks sent" in out
    told = re.sub(r"process \d+", "process N", error.decode().replace(str(tmp_path), "HERE"))
    assert told.replace(load_key(key).scheme.fingerprint, "0123") == TOLD
    assert not np.any(read_journal(journal).flags & NOISE)


@pytest.mark.realtime
def test_a_journal_outlives_the_run_and_a_run_its_key_file(tmp_path, key):
    configure(tmp_path)
    process = start(tmp_path, "--symbols", "3,1,0,2", "--stdin")
    assert process.stdin is not None
    wanted = 10
    while process.poll() is None and noisy_ticks(tmp_path) < wanted:
        if noisy_ticks(tmp_path) and key.exists():
            key.unlink()
            (tmp_path / "robot.toml").unlink()
            wanted = noisy_ticks(tmp_path) + 20
        process.stdin.write(b"v 0.2 0 0.1\n")
        process.stdin.flush()
        select.select([], [], [], 0.02)
    assert not key.exists()
    process.kill()
    process.communicate(timeout=PATIENCE_S)
    assert process.returncode == -signal.SIGKILL
    record = read_journal(tmp_path / "journal.csv")
    assert np.count_nonzero(record.flags == NOISE) >= wanted


def test_a_journal_that_cannot_be_written_is_an_error(tmp_path, key, capsys):
    configure(tmp_path)
    (tmp_path / "robot.toml").write_text((tmp_path / "robot.toml").read_text().replace("journal.csv", "no/journal.csv"))
    assert run(tmp_path, "--no-message", "--stdin", "--duration", "0") == 1
    assert "cannot write the journal" in capsys.readouterr().err


def test_a_folder_in_the_place_of_a_result_is_left_alone(tmp_path, key, capsys):
    wanted = ["export", "--key", key, "--channel", "robot0", "--message", 178, "-o", tmp_path]
    assert main(list(map(str, wanted))) == 1
    assert "name a file" in capsys.readouterr().err
    wanted[-1] = tmp_path / "new"
    assert main([*map(str, wanted), "--span", "1e308"]) == 2
    assert "shorter" in capsys.readouterr().err
    assert not list(tmp_path.parent.glob(f".{tmp_path.name}-*"))


@pytest.mark.parametrize(
    ("failure", "code", "says"),
    [(OSError(28, "No space left on device"), 1, "disk space"), (KeyboardInterrupt, 130, "")],
)
def test_a_full_disk_and_an_interrupt_get_one_sentence(key, capsys, monkeypatch, failure, code, says):
    def fail(*_):
        raise failure

    monkeypatch.setattr("mtm_onboard.protocol.load_key", fail)
    assert main(["show", "--key", str(key)]) == code
    error = capsys.readouterr().err
    assert error.count("\n") == 1
    assert says in error


def test_a_command_is_parsed_without_importing_the_others():
    every = list(choices_of(parser_of()))
    assert {word: list(choices_of(parser_of(word))) for word in every} == {word: [word] for word in every}
    assert list(choices_of(parser_of("runn"))) == every


def test_help_loads_nothing_that_it_does_not_need():
    code = "import sys; from mtm_onboard.cli import main\ntry: main(['--help'])\nfinally: print(*sys.modules)"
    root = Path(__file__).parents[2]
    # Without what the environment loads of its own accord.
    loaded = subprocess.run([sys.executable, "-S", "-c", code], cwd=root, capture_output=True, text=True, check=True)
    assert not {"numpy", "dataclasses", "inspect", "datetime", "json"} & set(loaded.stdout.splitlines()[-1].split())


def test_help_takes_neither_numpy_nor_long():
    code = "import sys; from mtm_onboard.cli import main\ntry: main(['--help'])\nfinally: print('numpy' in sys.modules)"
    shown = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout
    assert "keygen" in shown
    assert shown.endswith("False\n")
