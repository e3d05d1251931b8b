"""The option with which a command replaces what it did not make."""

from typing import Annotated

import typer

Force = Annotated[
    bool, typer.Option("--force", help="Replace a file that this command did not make; a key file never is.")
]
