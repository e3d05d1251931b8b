"""Options that several commands take alike, written down once, with the command that had them first."""

import inspect
from collections.abc import Callable
from typing import Any, TypeVar, get_type_hints

Command = TypeVar("Command", bound=Callable[..., Any])


def takes_options_of(other: Callable[..., Any], *names: str) -> Callable[[Command], Command]:
    """Give a command, which has `**shared` for them, the options `names` of another one: types, help and defaults."""

    def taking(command: Command) -> Command:
        theirs = inspect.signature(other).parameters
        own = [
            parameter
            for parameter in inspect.signature(command).parameters.values()
            if parameter.kind is not inspect.Parameter.VAR_KEYWORD
        ]
        shared = [theirs[name].replace(kind=inspect.Parameter.KEYWORD_ONLY) for name in names]
        hints, own_hints = get_type_hints(other, include_extras=True), get_type_hints(command, include_extras=True)
        own_hints.pop("shared", None)
        command.__annotations__ = own_hints | {name: hints[name] for name in names}
        # What a command line's library looks at; the command itself is called with everything by name.
        vars(command)["__signature__"] = inspect.Signature(
            [parameter.replace(annotation=command.__annotations__[parameter.name]) for parameter in [*own, *shared]]
        )
        return command

    return taking
