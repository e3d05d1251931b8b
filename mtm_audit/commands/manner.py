"""What the typed command lines have in common: how help and the version are asked for."""

from typing import Any

import typer

HELP_OPTIONS: dict[str, Any] = {"help_option_names": ["--help", "-h"], "max_content_width": 110}


def version_option(program: str) -> Any:
    """The option --version of a program."""

    def tell(asked: bool) -> None:
        if asked:
            print(f"{program} {_installed_version()}")
            raise typer.Exit

    return typer.Option("--version", callback=tell, is_eager=True, help="Print the version and exit.")


def _installed_version() -> str:
    """As `mtm_onboard.protocol.installing.program_version`, without numpy, which comes with all of the protocol."""
    # Takes as long to import as the help takes to print.
    from importlib.metadata import PackageNotFoundError, version

    try:
        return version("messages-through-motion")
    except PackageNotFoundError:
        return "(not installed, so without a version)"
