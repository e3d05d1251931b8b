"""What the commands of `mtm-hil` share: their options, and how they end."""

from collections.abc import Iterator
from contextlib import contextmanager
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from mtm_audit.commands.errors import reported

if TYPE_CHECKING:
    from rich.console import Console

    from mtm_onboard.runtime.message import Content


class Renderer(StrEnum):
    """Who draws the pictures of a simulated world."""

    SOFTWARE = "software"
    NATIVE = "native"


# A recording: `record` and `film`.
NewFolder = Annotated[Path, typer.Option(metavar="FOLDER", help="The folder to make; it must not exist.")]
MessageText = Annotated[
    str | None, typer.Option("--text", metavar="TEXT", help="The message as text, for keys whose payload is text.")
]
MessageBytes = Annotated[
    str | None, typer.Option("--hex", metavar="HEX", help="The message as bytes, for keys whose payload is bytes.")
]
MessageNumber = Annotated[int | None, typer.Option(metavar="N", help="The message as a number.")]
NoMessage = Annotated[bool, typer.Option("--no-message", help="Move without a message.")]
KeyFile = Annotated[
    Path | None, typer.Option(metavar="FILE", help="The key file; one is made in the folder without it.")
]
WorldSeed = Annotated[
    int, typer.Option(metavar="N", min=0, help="Decides everything random but the message's waveforms.")
]

# An experiment.
RendererName = Annotated[Renderer, typer.Option(help="Who draws the pictures: the software camera or the simulator.")]
FirstSeed = Annotated[int, typer.Option(metavar="N", min=0, help="The first rollout's seed.")]
CellSeed = Annotated[int, typer.Option(metavar="N", min=0, help="The first cell's seed.")]
Workers = Annotated[int | None, typer.Option(metavar="N", min=1, help="Processes; as many as cores by default.")]
OutCsv = Annotated[Path | None, typer.Option(metavar="FILE.csv", help="A CSV file to write as well.")]
Cells = Annotated[
    Path, typer.Option(metavar="FILE.jsonl", help="File of finished rollouts, with which an interrupted run goes on.")
]
# Where each keeps its finished cells unless told otherwise.
CELLS_FOLDER = Path("out/cells")


def content_of(number: int | None, text: str | None, hexadecimal: str | None, no_message: bool) -> "Content | None":
    """What is to be sent, None for nothing; raises BadParameter unless exactly one of these is asked for."""
    given = {"number": number, "text": text, "hex": hexadecimal}
    asked = {kind: value for kind, value in given.items() if value is not None}
    if len(asked) + no_message != 1:
        raise typer.BadParameter("give one of --message N, --text TEXT, --hex HEX and --no-message")
    if no_message:
        return None
    from mtm_onboard.protocol.errors import command_line_values
    from mtm_onboard.runtime.message import content_from_table

    with command_line_values():
        return content_from_table(asked)


def require_message_or_none(message: int | None, no_message: bool) -> None:
    """Raise BadParameter unless exactly one of a message and none at all is asked for."""
    if (message is None) != no_message:
        raise typer.BadParameter("give either --message N or --no-message")


@contextmanager
def reported_console(command: str = "mtm-hil", *outputs: Path | None, force: bool = False) -> Iterator["Console"]:
    """Yield a console; an error in the block is printed in one sentence and ends the program with its exit code.

    So is that of a file among `outputs`, None being one that was not asked for, which `command` did not make.
    """
    from rich.console import Console

    with reported("mtm-hil", "no half-written result is left"):
        from mtm_onboard.protocol.output_file import check_outputs

        check_outputs(command, *outputs, force=force)
        # What users name may look like markup.
        yield Console(markup=False)
