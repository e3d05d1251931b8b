"""The command line's own parser: help and refusals that look like those of the two other programs."""

import argparse
import sys
from typing import Any, Never

_VALUES = {int: "a whole number", float: "a number"}


class Parser(argparse.ArgumentParser):
    """A parser whose commands and options are sentences, and which suggests what may have been meant."""

    def __init__(self, **options: Any) -> None:
        options.setdefault("formatter_class", Formatter)
        super().__init__(add_help=False, allow_abbrev=False, **options)
        self._positionals.title, self._optionals.title = "Arguments", "Options"
        self.add_argument("-h", "--help", action="help", help="show this message and exit")

    def error(self, message: str) -> Never:
        """Say what is wrong and where help is, and leave with 2."""
        text = f"{self._short_usage()}\nTry '{self.prog} --help' for help.\n\nError: {message}\n"
        sys.stderr.write(text)
        raise SystemExit(2)

    def format_usage(self) -> str:
        """The one line that stands over the help."""
        return f"{self._short_usage()}\n"

    def format_help(self) -> str:
        """The usage, what it does, and every argument and option."""
        formatter = self._get_formatter()
        formatter.add_text(self.description)
        for group in self._action_groups:
            formatter.start_section((group.title or "").capitalize())
            formatter.add_text(group.description)
            formatter.add_arguments(group._group_actions)
            formatter.end_section()
        return f"{self._short_usage()}\n\n{formatter.format_help()}"

    def _short_usage(self) -> str:
        commands = any(isinstance(action, argparse._SubParsersAction) for action in self._actions)
        return f"Usage: {self.prog} [OPTIONS]" + (" COMMAND [ARGS]..." if commands else "")

    def parse_args(self, args: Any = None, namespace: Any = None) -> Any:
        """What was given; leaves with 2 for what there is not, and says what may have been meant."""
        known, unknown = self.parse_known_args(args, namespace)
        if unknown:
            used: Parser = getattr(known, "parser", self)
            if unknown[0].startswith("-"):
                used._refuse_option(unknown[0])
            used.error(f"Got unexpected extra argument ({unknown[0]})")
        return known

    def parse_known_args(self, args: Any = None, namespace: Any = None) -> Any:
        """What was given, and the rest; an option that there is not comes before one that is missing."""
        words = list(sys.argv[1:] if args is None else args)
        commands = any(isinstance(action, argparse._SubParsersAction) for action in self._actions)
        for word in words:
            if word == "--" or (commands and not word.startswith("-")):
                break
            if word.startswith("--") and word.partition("=")[0] not in self._option_string_actions:
                self._refuse_option(word)
        return super().parse_known_args(words, namespace)

    def _refuse_option(self, word: str) -> Never:
        name = word.partition("=")[0]
        near = sorted(_near(name, list(self._option_string_actions)))
        self.error(f"No such option: {name}" + (f" (Possible options: {', '.join(near)})" if near else ""))

    def _check_value(self, action: argparse.Action, value: Any) -> None:
        choices = None if action.choices is None else [str(choice) for choice in action.choices]
        if choices is None or value in choices:
            return
        if isinstance(action, argparse._SubParsersAction):
            near = _near(value, choices)
            meant = f" Did you mean {', '.join(repr(name) for name in near)}?" if near else ""
            self.error(f"No such command {value!r}.{meant}")
        self.error(f"Invalid value for {_named(action)}: {value!r} is not one of {', '.join(choices)}.")

    def _get_value(self, action: argparse.Action, arg_string: str) -> Any:
        convert = self._registry_get("type", action.type, action.type)
        try:
            return convert(arg_string) if callable(convert) else arg_string
        except argparse.ArgumentTypeError as error:
            self.error(f"Invalid value for {_named(action)}: {error}")
        except (TypeError, ValueError):
            wanted = _VALUES.get(convert, f"of the form {action.metavar}") if callable(convert) else ""
            self.error(f"Invalid value for {_named(action)}: {arg_string!r} is not {wanted}.")


class Formatter(argparse.HelpFormatter):
    """Capital letters, full stops, and each option's values once."""

    def _format_action_invocation(self, action: argparse.Action) -> str:
        if not action.option_strings or action.nargs == 0:
            return super()._format_action_invocation(action)
        return f"{', '.join(action.option_strings)} {self._format_args(action, str(action.metavar))}"

    def _metavar_formatter(self, action: argparse.Action, default_metavar: str) -> Any:
        if action.metavar is None and action.choices is not None and not hasattr(action, "add_parser"):
            choices = "|".join(str(choice) for choice in action.choices)
            return lambda size: (f"<{choices}>",) * size
        return super()._metavar_formatter(action, default_metavar)

    def _expand_help(self, action: argparse.Action) -> str:
        text = super()._expand_help(action)
        first = text.partition(" ")[0]
        # A value that may be given stays as it is given.
        begins = text[:1] if ":" in first or first in str(action.metavar) else text[:1].upper()
        ended = text if text.endswith((".", ")")) else f"{text}."
        required = " [required]" if action.required and action.option_strings else ""
        return f"{begins}{ended[1:]}{required}"


def _near(word: str, known: list[str]) -> list[str]:
    # Imported for mistakes alone: it takes as long as half of a command's own modules.
    from difflib import get_close_matches

    return get_close_matches(word, known)


def _named(action: argparse.Action) -> str:
    return f"'{max(action.option_strings, key=len, default=str(action.metavar or action.dest))}'"
