"""No command of any program replaces a key file, or a file that it did not make."""

import re
import shutil
from dataclasses import replace
from datetime import date

import pytest

from mtm_onboard.protocol import save_key
from mtm_onboard.protocol.key import generate_master
from tests.command_lines import Command, Parameter, all_commands
from tests.onboard.schemes import small_scheme

DAY = date(2025, 1, 1)
# Options that name what is read. All others that name a file or folder name what is written.
INPUTS = {
    "--key", "--anchor", "--disclosed", "--profile", "--revoked", "--like", "--check", "--scheme", "--master",
    "--config", "--socket", "--device-key", "--camera",
}  # fmt: skip
# What `identify` learns is an output, though `decode` reads it.
OUTPUTS = {("mtm-hil identify", "--profile")}
# For parameters that must be given and are no files; files are made where they are named.
VALUES = {
    "--bits": "8", "--rate": "50", "--id": "x", "--message": "1", "--day": "2025-01-02", "--serial": "0" * 16,
    "world": "discovery", "source": "udp://127.0.0.1:9",
}  # fmt: skip
# Where one of several must be given.
ALSO = {
    "mtm-audit decode": ["--key", "{folder}/in.key"], "mtm-audit plan": ["--rate", "50"],
    "mtm-hil record": ["--no-message"], "mtm-hil film": ["--no-message"],
    "mtm-onboard keygen": ["--preset", "robomaster-fleet"],
    "mtm-onboard issue": ["--auditor", "--first-day", str(DAY), "--days", "1"],
    "mtm-onboard disclose": ["--allow-unsynchronised"], "mtm-onboard export": ["--message", "1"],
}  # fmt: skip
# Where an option goes with another than the command usually has.
ALSO_WITH = {("mtm-audit decode", "--write-disclosed"): ["--anchor", "{folder}/in.key"]}
REFUSAL = r"is a key file|was not made by|exists already|is no finished cell|is no revocation list|is no folder"


def is_output(command: Command, parameter: Parameter) -> bool:
    named = (command.name, parameter.name)
    return parameter.is_option and parameter.is_path and (parameter.name not in INPUTS or named in OUTPUTS)


CASES = [(command, own) for command in all_commands() for own in command.parameters if is_output(command, own)]


@pytest.fixture(autouse=True)
def folder(tmp_path, monkeypatch):
    """Where commands run: a master's key file, in.key, and nothing else."""
    monkeypatch.chdir(tmp_path)
    save_key(generate_master("fake", replace(small_scheme(), schedule="rolling"), DAY, 366), tmp_path / "in.key")
    return tmp_path


def line_with(command: Command, option: str, path, folder) -> list[str]:
    """What must be given so that the command runs, and the option."""
    also = ALSO_WITH.get((command.name, option), ALSO.get(command.name, ()))
    words = [word.format(folder=folder) for word in also]
    for own in command.parameters:
        if own.is_required and own.name != option and own.name not in words:
            value = VALUES.get(own.name)
            if value is None:
                assert own.is_path, f"say in VALUES what {command.name} {own.name} may be"
                value = folder / f"{own.name.strip('-')}.in"
                shutil.copy(folder / "in.key", value)
            words += [own.name, str(value)] if own.is_option else [str(value)]
    return [*words, option, str(path)]


def refused(command: Command, words: list[str], capsys) -> str:
    code = command.run(*words)
    error = capsys.readouterr().err
    assert code == 1, error
    assert re.fullmatch(rf"{command.program}: [^\n]*(?:{REFUSAL})[^\n]*\n", error)
    return error


def test_every_program_has_commands_that_write():
    assert {command.program for command, _ in CASES} == {"mtm-onboard", "mtm-audit", "mtm-hil"}
    assert len(CASES) > 50


@pytest.mark.parametrize(("command", "option"), CASES, ids=lambda value: value.name)
def test_a_key_file_and_a_foreign_file_survive(command, option, folder, capsys):
    suffix = re.search(r"\.\w+$", option.metavar)
    foreign = folder / f"foreign{'.csv' if suffix is None else suffix[0]}"
    foreign.write_text("what somebody else keeps here")
    secret = folder / f"secret{foreign.suffix}"
    shutil.copy(folder / "in.key", secret)
    forced = ["--force"] if any(own.name == "--force" for own in command.parameters) else []
    for path, more in ((foreign, []), (secret, []), (secret, forced)):
        before = path.read_bytes()
        refused(command, [*line_with(command, option.name, path, folder), *more], capsys)
        assert path.read_bytes() == before
    written = {"foreign", "secret", "in"} | {own.name.strip("-") for own in command.parameters}
    assert {path.stem for path in folder.iterdir()} <= written


@pytest.mark.parametrize(
    "command",
    dict.fromkeys(command for command, own in CASES if own.name not in {"--cells", "--list"}),
    ids=lambda command: command.name,
)
def test_what_replaces_its_own_can_be_forced(command):
    """Those whose results stay for good have no --force: they make keys or new folders."""
    made_once = any("must not exist" in own.help for own in command.parameters)
    assert made_once != any(own.name == "--force" for own in command.parameters)
