"""The commands in the documents exist, and so does every option that they are given."""

import re
import shlex
from functools import cache
from pathlib import Path

import pytest
import typer

import hil.cli
import mtm_audit.cli
from mtm_onboard.cli import main as onboard

ROOT = Path(__file__).parents[2]
PAGES = [ROOT / "README.md", ROOT / "firmware_shim" / "README.md", *sorted((ROOT / "docs").rglob("*.md"))]
PROGRAMS = ("mtm-onboard", "mtm-audit", "mtm-hil")


def command_lines(text: str) -> list[list[str]]:
    """Code that begins with a program of ours, lines and spans of it, continued lines joined; as words."""
    joined = re.sub(r"\\\n\s*", "", text)
    lines = re.findall(r"^(?: {4,}|\$ |)((?:mtm-onboard|mtm-audit|mtm-hil) [^`\n]*)$", joined, re.MULTILINE)
    lines += re.findall(r"`((?:mtm-onboard|mtm-audit|mtm-hil) [^`]+)`", joined)
    return [shlex.split(re.sub(r"\[(--.*?)\]", r"\1", line), comments=True) for line in lines]


LINES = [words for page in PAGES for words in command_lines(page.read_text(encoding="utf-8"))]


@cache
def options_of(program: str, command: tuple[str, ...]) -> frozenset[str]:
    """The options of a command; raises KeyError when there is no such command."""
    node = typer.main.get_command({"mtm-audit": mtm_audit.cli.app, "mtm-hil": hil.cli.app}[program])
    for name in command:
        node = node.commands[name]
    return frozenset(option for parameter in node.params for option in parameter.opts)


def check(words: list[str], capsys) -> list[str]:
    """What is wrong with a command line."""
    program, name, *rest = words
    given = {word.partition("=")[0] for word in rest if re.match(r"--?[a-z]", word)}
    if program == "mtm-onboard":
        try:
            onboard([name, "--help"])
        except SystemExit as ended:
            if ended.code:
                return [name]
        return sorted(given - set(re.findall(r"--?[a-z][a-z-]*", capsys.readouterr().out)))
    command = (name, rest[0]) if name == "paper" else (name,)
    try:
        return sorted(given - options_of(program, command) - {"--help"})
    except KeyError as unknown:
        return [str(unknown)]


def test_there_are_command_lines_of_all_programs():
    assert {words[0] for words in LINES} == set(PROGRAMS)
    assert len(LINES) > 60


@pytest.mark.parametrize("program", PROGRAMS)
def test_command_lines_are_understood(program, capsys):
    assert [(words, wrong) for words in LINES if words[0] == program and (wrong := check(words, capsys))] == []


@pytest.mark.parametrize(
    "line", ["mtm-onboard fly", "mtm-onboard run --speed 3", "mtm-hil paper chess", "mtm-audit decode --x"]
)
def test_a_wrong_command_line_would_be_noticed(line, capsys):
    assert check(line.split(), capsys)
