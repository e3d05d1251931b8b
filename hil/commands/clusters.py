"""`--scheduler`, the option with which every experiment of `mtm-hil` runs on a cluster in the place of this machine."""

import inspect
from collections.abc import Callable
from functools import wraps
from typing import Annotated, Any, get_type_hints

import typer

Scheduler = Annotated[
    str | None,
    typer.Option(metavar="ADDRESS", help="A Dask cluster to work on, such as tcp://192.168.0.2:8786."),
]
_NAME = "scheduler"


def takes_scheduler(command: Callable[..., None]) -> Callable[..., None]:
    """The command with the option, if it computes cells; another command as it is."""
    signature = inspect.signature(command)
    if "cells" not in signature.parameters:
        return command

    @wraps(command)
    def on_scheduler(*, scheduler: str | None, **options: Any) -> None:
        from hil.experiments.runs.sweep import swept_on

        if scheduler is not None and options.get("workers") is not None:
            raise typer.BadParameter("the cluster has its own; leave it or --scheduler out", param_hint="--workers")
        with swept_on(scheduler):
            command(**options)

    option = inspect.Parameter(_NAME, inspect.Parameter.KEYWORD_ONLY, default=None, annotation=Scheduler)
    vars(on_scheduler)["__signature__"] = signature.replace(parameters=[*signature.parameters.values(), option])
    on_scheduler.__annotations__ = get_type_hints(command, include_extras=True) | {_NAME: Scheduler}
    return on_scheduler
