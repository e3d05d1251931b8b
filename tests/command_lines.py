"""The commands of the three programs and their parameters, as their command lines define them."""

import argparse
import importlib
import inspect
import typing
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import typer

import hil.cli
import mtm_audit.cli
from mtm_onboard.cli import parser_of

PACKAGES = {"mtm-onboard": "mtm_onboard", "mtm-audit": "mtm_audit", "mtm-hil": "hil"}
PROGRAMS = tuple(PACKAGES)


@dataclass(frozen=True)
class Parameter:
    """An option, by its longest name, or an argument, by what the help calls it."""

    name: str
    is_option: bool
    is_required: bool
    is_path: bool
    is_flag: bool
    metavar: str
    help: str


@dataclass(frozen=True)
class Command:
    """One command that can be run: its name includes the program's."""

    name: str
    parameters: tuple[Parameter, ...]

    @property
    def program(self) -> str:
        return self.name.partition(" ")[0]

    @property
    def words(self) -> list[str]:
        return self.name.split()[1:]

    def run(self, *arguments: object) -> int:
        """The exit code of running it in this process."""
        main = importlib.import_module(f"{PACKAGES[self.program]}.cli").main
        try:
            code = main([*self.words, *map(str, arguments)])
        except SystemExit as left:
            code = left.code
        return int(code or 0)


def all_commands() -> tuple[Command, ...]:
    """Every command of every program, in the order of their help."""
    typed = {"mtm-audit": mtm_audit.cli.app, "mtm-hil": hil.cli.app}
    found = [*_argparse_commands("mtm-onboard", parser_of())]
    for program, app in typed.items():
        found += _typer_commands(program, typer.main.get_command(app))
    return tuple(found)


def _argparse_commands(name: str, parser: argparse.ArgumentParser) -> Iterator[Command]:
    for action in parser._actions:
        if isinstance(action, argparse._SubParsersAction):
            for word, own in action.choices.items():
                yield Command(f"{name} {word}", tuple(_argparse_parameters(own)))


def _argparse_parameters(parser: argparse.ArgumentParser) -> Iterator[Parameter]:
    for action in parser._actions:
        if action.dest == "help":
            continue
        yield Parameter(
            name=max(action.option_strings, key=len, default=action.dest), is_option=bool(action.option_strings),
            is_required=action.required, is_path=action.type is Path, is_flag=action.nargs == 0,
            metavar=str(action.metavar or ""), help=action.help or "",
        )  # fmt: skip


def _typer_commands(name: str, node: typing.Any) -> Iterator[Command]:
    if hasattr(node, "commands"):
        for word, below in node.commands.items():
            yield from _typer_commands(f"{name} {word}", below)
        return
    hints = typing.get_type_hints(inspect.unwrap(node.callback))
    yield Command(name, tuple(_typer_parameter(own, hints) for own in node.params if own.name in hints))


def _typer_parameter(own: typing.Any, hints: dict[str, typing.Any]) -> Parameter:
    is_option = own.opts[0].startswith("-")
    return Parameter(
        name=max(own.opts, key=len), is_option=is_option, is_required=own.required,
        is_path="Path" in str(hints[own.name]), is_flag=hints[own.name] is bool, metavar=own.metavar or "",
        help=own.help or "",
    )  # fmt: skip
