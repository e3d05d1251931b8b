"""One manner in three programs: help, versions, names, suggestions, exit codes, and how a wrong value is refused."""

import importlib
import importlib.metadata
import re
import subprocess
from pathlib import Path

import pytest

from mtm_audit.tracking.registry import TRACKERS
from mtm_onboard.protocol import Key, save_key
from tests.command_lines import PACKAGES, PROGRAMS, all_commands
from tests.onboard.schemes import FAKE_SECRET, small_scheme

ROOT = Path(__file__).parents[1]
COMMANDS = all_commands()
named = pytest.mark.parametrize("command", COMMANDS, ids=lambda command: command.name)
each = pytest.mark.parametrize("program", PROGRAMS)
# Options whose values are listed in the help in the place of a name for them.
CHOICES = {
    "--preset", "--strategy", "--wire", "--camera", "--quality", "--floor", "--renderer", "--frame",
}  # fmt: skip
# What is wrong whatever the files hold; the files named are none.
WRONG = """
mtm-audit decode x.tum --key r.key --detector guess
mtm-audit decode x.tum --key r.key --tracker guess
mtm-audit decode x.tum --key r.key --tracker colour:mauve
mtm-audit decode x.tum --key r.key --speed -1
mtm-audit decode x.tum --key r.key --frame-rate 0
mtm-audit decode x.tum --key r.key --plot x.bmp
mtm-audit decode x.tum --key r.key --unit parsec
mtm-audit decode x.tum --key r.key --time-unit h
mtm-audit decode x.tum --key r.key --up q
mtm-audit decode x.tum --key r.key --heading-axis q
mtm-audit decode x.tum --key r.key --body q
mtm-audit decode x.tum --key r.key --threshold 0
mtm-audit decode x.tum --key r.key --at yesterday
mtm-audit decode x.tum --key r.key --onset soon
mtm-audit decode x.tum --key r.key --assign robot0
mtm-audit decode x.tum
mtm-audit profile x.tum --key r.key --out p.profile --tracker guess
mtm-audit plan x.csv --bits 0 --rate 50
mtm-audit plan x.csv --bits many --rate 50
mtm-audit plan x.csv --bits 8 --accuracy 2 --rate 50
mtm-hil record --out o --message 1 --plant tank
mtm-hil record --out o --no-message --seconds nan
mtm-hil record --out o --no-message --seconds -1
mtm-hil record --out o
mtm-hil film chess --out o --message 1
mtm-hil bench --plants tank
mtm-hil sweep chess --out o.csv
mtm-hil sweep robomaster --out o.csv --detector guess
mtm-hil false-alarms --detector guess
mtm-hil verdicts sure --only guess
mtm-hil real . --band x
mtm-hil endurance --hours nan
mtm-onboard keygen --id x --out y.key --preset robomaster-fleet --channel a
mtm-onboard keygen --id x --out y.key --preset robomaster-fleet --band 5
mtm-onboard keygen --id x --out y.key --preset robomaster-fleet --combine perhaps
mtm-onboard keygen --id x --out y.key --preset robomaster-fleet --alphabet 1
mtm-onboard keygen --id x --out y.key --preset robomaster-fleet --first-day soon
mtm-onboard keygen --id x --out y.key --preset robomaster-fleet --days 0
mtm-onboard keygen --id +++ --out y.key --preset robomaster-fleet
mtm-onboard keygen --id x --out y.key --preset guess
mtm-onboard keygen --id x --out y.key
mtm-onboard revoke --list l --serial 3
mtm-onboard export --key r.key --symbols 0 --channel a --out i --span -1
mtm-onboard export --key r.key --symbols a --channel a --out i
mtm-onboard doctor --config c --key r.key --seconds x
mtm-onboard run --config c --key r.key --message 1 --duration -1
mtm-onboard status --socket s --watch 0
""".strip().splitlines()


@pytest.fixture(autouse=True)
def folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    save_key(Key("fake", FAKE_SECRET, small_scheme()), tmp_path / "r.key")
    return tmp_path


def run(program, *arguments):
    """The exit code of a program in this process."""
    try:
        code = importlib.import_module(f"{PACKAGES[program]}.cli").main(list(map(str, arguments)))
    except SystemExit as left:
        code = left.code
    return code or 0


@named
def test_help_is_asked_for_in_two_ways(command, capsys):
    assert command.run("-h") == 0
    short = capsys.readouterr().out
    assert command.run("--help") == 0
    assert short == capsys.readouterr().out
    assert short.startswith(f"Usage: {command.name} [OPTIONS]")
    assert "-h, --help" in short
    assert not re.search(r"<(bool|path|int|float|text|int range|float range)>", re.sub(r"\S+ <path>  ", "", short))


@named
def test_an_option_that_there_is_not_is_a_usage_error(command, capsys):
    options = [own.name for own in command.parameters if own.is_option and own.name.startswith("--")]
    wrong = f"{options[0]}x" if options else "--helpx"
    assert command.run(wrong) == 2
    error = capsys.readouterr().err
    assert f"Try '{command.name} --help' for help." in error
    assert f"No such option: {wrong}" in error
    assert (options[0] if options else "--help") in error.partition("Possible options")[2]


@named
def test_every_value_has_a_name_that_means_something(command):
    for own in command.parameters:
        if own.is_flag or own.name in CHOICES:
            continue
        assert own.metavar, f"{command.name} {own.name} needs a metavar"
        assert own.help, f"{command.name} {own.name} has no help"


@each
def test_a_program_says_its_version(program, capsys):
    assert run(program, "--version") == 0
    out = capsys.readouterr().out
    assert out == f"{program} {importlib.metadata.version('messages-through-motion')}\n"


@each
def test_a_program_without_a_command_shows_what_there_is(program, capsys):
    assert run(program) == 2
    shown = "".join(capsys.readouterr())
    assert shown.startswith(f"Usage: {program} [OPTIONS] COMMAND [ARGS]...")
    for command in COMMANDS:
        if command.program == program:
            assert command.words[0] in shown


@pytest.mark.parametrize(
    ("program", "wrong", "meant"),
    [("mtm-onboard", "keygn", "keygen"), ("mtm-audit", "decod", "decode"), ("mtm-hil", "recrd", "record")],
)
def test_a_command_that_was_misspelt_is_suggested(program, wrong, meant, capsys):
    assert run(program, wrong) == 2
    assert f"No such command '{wrong}'. Did you mean '{meant}'?" in capsys.readouterr().err


@pytest.mark.parametrize("line", WRONG)
def test_a_wrong_value_is_always_two(line, capsys, folder):
    before = sorted(folder.iterdir())
    program, *arguments = line.split()
    assert run(program, *arguments) == 2
    out, error = capsys.readouterr()
    assert out == ""
    assert "Error: " in error or (error.startswith(f"{program}: ") and error.count("\n") == 1)
    assert not re.search(r"(?<![-\w])_[a-z]|Traceback|\bargparse\b", error)
    assert [path for path in sorted(folder.iterdir()) if path.name != "out"] == before


def test_the_help_names_every_tracker(capsys):
    kinds = [re.split(r"[\[:]", one)[0] for one in re.split(r", (?=[a-z]+[\[:])", TRACKERS)]
    assert len(kinds) >= 7
    for command in COMMANDS:
        for own in command.parameters:
            # Some need all of a film, and cannot watch.
            if own.name == "--tracker" and command.name != "mtm-audit watch":
                assert [kind for kind in kinds if kind not in own.help] == [], command.name


@pytest.mark.parametrize("shell", ["bash"])
@each
def test_a_shell_completes_commands_and_options(program, shell, capsys, monkeypatch):
    words = [command.words[0] for command in COMMANDS if command.program == program]
    if program == "mtm-onboard":
        assert run(program, "--show-completion", shell) == 0
        script = capsys.readouterr().out
        asked = f'{script}\nCOMP_WORDS=({program} ""); COMP_CWORD=1; _mtm_onboard; printf "%s\\n" "${{COMPREPLY[@]}}"\n'
        asked += f'COMP_WORDS=({program} keygen --sch); COMP_CWORD=2; _mtm_onboard; printf "%s\\n" "${{COMPREPLY[@]}}"'
        given = subprocess.run(["bash", "-c", asked], capture_output=True, text=True, check=True).stdout.split()
        assert {"--scheme", "--schedule"} <= set(given)
    else:
        name = program.upper().replace("-", "_")
        monkeypatch.setenv(f"_{name}_COMPLETE", f"complete_{shell}")
        monkeypatch.setenv("COMP_WORDS", f"{program} ")
        monkeypatch.setenv("COMP_CWORD", "1")
        assert run(program) == 0
        given = capsys.readouterr().out.split()
    assert set(words) <= set(given)


def test_the_page_of_exit_codes_names_what_commands_say(capsys):
    page = (ROOT / "docs" / "command-line.md").read_text(encoding="utf-8")
    usual = {0, 1, 2, 130, 143}
    told = {
        name: set(map(int, codes.split(", ")))
        for name, codes in re.findall(r"^\| `(mtm-[^`]+)` \| ([\d, ]+) \|", page, re.MULTILINE)
    }
    known = set(map(int, re.findall(r"^\| (\d+) \|", page, re.MULTILINE)))
    said = {}
    for command in COMMANDS:
        command.run("--help")
        text = " ".join(capsys.readouterr().out.split())
        line = re.search(r"Exit codes: ([^.]*)\.", text)
        if line and (more := {int(code) for code in re.findall(r"\b\d+\b", line[1])} - usual):
            said[command.name] = more
    assert told == said
    assert set().union(usual, *told.values()) == known
