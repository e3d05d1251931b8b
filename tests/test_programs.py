"""The three programs: what the world around them and their inputs may be, each time one sentence and no traceback."""

import importlib
import os
import signal
import subprocess
import sys
from pathlib import Path

import pytest

from mtm_onboard.journal.journal import Journal
from mtm_onboard.model.velocity import BodyVelocity
from mtm_onboard.protocol import Key, save_key
from mtm_onboard.protocol.journal_file import COLUMNS, JournalHeader
from tests.onboard.schemes import FAKE_SECRET, small_scheme

PROGRAMS = {"mtm-onboard": "mtm_onboard", "mtm-audit": "mtm_audit", "mtm-hil": "hil"}
PATIENCE_S = 60
# Runs a program in which loading the module of its command line brings an interrupt, as Ctrl-C does at that moment.
INTERRUPTED = """
import os, runpy, signal, sys
class Interrupting:
    def find_spec(self, name, path=None, target=None):
        if name == sys.argv[0] + ".cli":
            os.kill(os.getpid(), signal.SIGINT)
sys.argv = sys.argv[1:]
sys.meta_path.insert(0, Interrupting())
runpy.run_module(sys.argv[0], run_name="__main__")
"""
JOURNAL = JournalHeader(
    fingerprint="0123456789abcdef", key_id="fake-key", robot="robot0", channel="a", symbols=(0, 3, 1, 2), repeat=True,
    rate_hz=50.0, start_s=10.0, start_unix_s=1.7e9,
)  # fmt: skip
LONG_NUMBER = "7" * 400
ENDLESS_NUMBER = "7" * 5000


@pytest.fixture
def key(tmp_path):
    save_key(Key("fake-key", FAKE_SECRET, small_scheme()), tmp_path / "r.key")
    return tmp_path / "r.key"


@pytest.fixture
def config(tmp_path):
    path = tmp_path / "robot.toml"
    path.write_text(
        '[robot]\nname = "r"\nchannel = "a"\n[transport]\nkind = "none"\n[limits]\nspeed_mps = 1.0\n'
        'turn_rate_radps = 2.0\n[source]\nkind = "stdin"\n'
    )
    return path


@pytest.fixture
def journal(tmp_path):
    with Journal(tmp_path / "r.csv", JOURNAL, threaded=False) as journal:
        for tick in range(100):
            journal.append(tick, 10.0 + tick / 50.0, BodyVelocity(0.1, 0.0, 0.0), BodyVelocity(0.2, 0.0, 0.0), 1, 0.0)
    return tmp_path / "r.csv"


@pytest.fixture
def called(capsys):
    """Run a program's command in this process; an input that it waits for ends the wait."""

    def call(program: str, *arguments: object) -> subprocess.CompletedProcess[str]:
        main = importlib.import_module(f"{PROGRAMS[program]}.cli").main
        former = signal.signal(signal.SIGALRM, too_long)
        signal.alarm(PATIENCE_S)
        try:
            code = main(list(map(str, arguments)))
        except SystemExit as left:
            code = left.code
        finally:
            signal.alarm(0)
            signal.signal(signal.SIGALRM, former)
        out, err = capsys.readouterr()
        return subprocess.CompletedProcess([program], code or 0, out, err)

    return call


def too_long(*_: object) -> None:
    raise AssertionError("the program waits")


def ran(program: str, *arguments: object, **options: object) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, "-m", PROGRAMS[program], *map(str, arguments)]
    return subprocess.run(
        command, stdin=subprocess.DEVNULL, timeout=PATIENCE_S, text=True, check=False,
        **{"stdout": subprocess.PIPE, "stderr": subprocess.PIPE} | options,
    )  # fmt: skip


def one_sentence(done: subprocess.CompletedProcess[str], program: str, code: int = 1) -> str:
    assert done.returncode == code, done.stderr
    assert done.stderr.startswith(f"{program}: ")
    assert done.stderr.count("\n") == 1
    return done.stderr


@pytest.mark.parametrize("program", PROGRAMS)
def test_an_interrupt_while_a_program_loads_is_one_sentence(program):
    command = [sys.executable, "-c", INTERRUPTED, PROGRAMS[program], "--help"]
    done = subprocess.run(command, capture_output=True, text=True, timeout=PATIENCE_S, check=False)
    assert "interrupted" in one_sentence(done, program, 130)


@pytest.mark.parametrize("program", PROGRAMS)
def test_standard_output_that_is_closed_is_one_sentence(program):
    command = ["sh", "-c", 'exec "$@" >&-', "sh", sys.executable, "-m", PROGRAMS[program], "--help"]
    done = subprocess.run(command, stderr=subprocess.PIPE, text=True, timeout=PATIENCE_S, check=False)
    assert "closed" in one_sentence(done, program)


@pytest.mark.parametrize(
    ("program", "command", "file"),
    [("mtm-onboard", ("show", "--key"), "key"), ("mtm-audit", ("journal", "--json"), "journal")],
)
@pytest.mark.parametrize("output", ["nobody", "full disk"])
def test_output_that_nobody_takes_is_one_sentence(program, command, file, output, request):
    reader, writer = os.pipe()
    os.close(reader)
    taken = writer if output == "nobody" else os.open("/dev/full", os.O_WRONLY)
    done = ran(program, *command, request.getfixturevalue(file), stdout=taken)
    assert ("nobody reads" if output == "nobody" else "disk space") in one_sentence(done, program)
    os.close(writer)


@pytest.mark.parametrize("kind", ["pipe", "endless"])
@pytest.mark.parametrize("named", ["--config", "--key", "--scheme", "journal", "decode", "plan", "profile", "record"])
def test_a_pipe_and_a_file_without_end_are_refused(called, kind, named, tmp_path, key, config):
    path = tmp_path / "input"
    if kind == "pipe":
        os.mkfifo(path, mode=0o600)
    else:
        path = Path("/dev/zero")
    program, arguments = {
        "--config": ("mtm-onboard", ("run", "--config", path, "--key", key, "--message", 1)),
        "--key": ("mtm-onboard", ("run", "--config", config, "--key", path, "--message", 1)),
        "--scheme": ("mtm-onboard", ("keygen", "--scheme", path, "--id", "x", "--out", tmp_path / "x.key")),
        "journal": ("mtm-audit", ("journal", path)),
        "decode": ("mtm-audit", ("decode", path, "--key", key)),
        "plan": ("mtm-audit", ("plan", path, "--bits", 8, "--rate", 50)),
        "profile": ("mtm-audit", ("decode", config, "--key", key, "--profile", path)),
        "record": ("mtm-hil", ("record", "--out", tmp_path / "x", "--message", 1, "--key", path)),
    }[named]
    assert "not a file" in one_sentence(called(program, *arguments), program)


@pytest.mark.parametrize("number", [LONG_NUMBER, ENDLESS_NUMBER, f"-{LONG_NUMBER}"])
@pytest.mark.parametrize("named", ["speed_mps", "give_up_s", "rate_hz", "sigma"])
def test_a_whole_number_of_hundreds_of_digits_is_one_sentence(called, number, named, key, config):
    lines = {
        "speed_mps": (config, "speed_mps = 1.0"), "give_up_s": (config, "[source]"), "rate_hz": (key, "rate_hz = 50.0"),
        "sigma": (key, "sigma = 0.1"),
    }  # fmt: skip
    path, line = lines[named]
    text = path.read_text()
    assert line in text
    new = f"[link]\ngive_up_s = {number}\n[source]" if named == "give_up_s" else f"{named} = {number}"
    path.write_text(text.replace(line, new))
    run = ("run", "--config", config, "--key", key, "--message", 1, "--duration", 0)
    one_sentence(called("mtm-onboard", *run), "mtm-onboard")
    if path == key:
        one_sentence(called("mtm-audit", "decode", config, "--key", key), "mtm-audit")
        one_sentence(called("mtm-hil", "record", "--out", config.parent / "x", "--message", 1, "--key", key), "mtm-hil")


@pytest.mark.parametrize(
    "line",
    [
        "1e300,12,0,0,0,0,0,0,0,1", "9007199254740993,12,0,0,0,0,0,0,0,1", "100.5,12,0,0,0,0,0,0,0,1",
        "100,12,1e300,0,0,0,0,0,0,1", "100,12,0,0,0,0,0,0,0,1e300", "100,12,0,0,0,0,0,0,0,-1",
        f"{LONG_NUMBER},12,0,0,0,0,0,0,0,1", f"{ENDLESS_NUMBER},12,0,0,0,0,0,0,0,1",
        f'# {{"tick": {LONG_NUMBER}, "text": "x"}}', f'# {{"tick": {ENDLESS_NUMBER}, "text": "x"}}',
        '# {"tick": 7, "text": "\\ud800"}', '# {"tick": true, "text": "x"}', "# " + "[" * 100_000,
    ],
)  # fmt: skip
def test_a_damaged_row_of_a_journal_is_counted_and_left_out(called, journal, tmp_path, line):
    with journal.open("a") as file:
        file.write(line + "\n")
    shown = called("mtm-audit", "journal", journal)
    assert (shown.returncode, shown.stderr) == (0, "")
    read = called("mtm-audit", "journal", journal, "--json", "--plot", tmp_path / "r.png")
    assert (read.returncode, read.stderr) == (0, "")
    assert '"damaged_lines": 1' in read.stdout


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ('"rate_hz": 50.0', f'"rate_hz": {LONG_NUMBER}'), ('"rate_hz": 50.0', '"rate_hz": "fast"'),
        ('"rate_hz": 50.0', '"rate_hz": 0'), ('"start_unix_s": 1700000000.0', '"start_unix_s": 1e300'),
        ('"start_s": 10.0', '"start_s": null'), ("[0, 3, 1, 2]", f"[{LONG_NUMBER}]"), ("[0, 3, 1, 2]", '"ab"'),
        ('"robot": "robot0"', '"robot": 7'), ('"robot": "robot0"', '"robot": "\\udc00"'),
    ],
)  # fmt: skip
def test_a_damaged_header_of_a_journal_is_one_sentence(called, journal, old, new):
    text = journal.read_text()
    assert old in text
    journal.write_text(text.replace(old, new))
    assert "journal" in one_sentence(called("mtm-audit", "journal", journal), "mtm-audit")


def test_the_journal_that_these_tests_damage_is_a_sound_one(called, journal):
    assert journal.read_text().splitlines()[1] == ",".join(COLUMNS)
    assert '"damaged_lines": 0' in called("mtm-audit", "journal", journal, "--json").stdout
