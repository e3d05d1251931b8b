"""`mtm-audit` and `python -m mtm_audit`: what comes before the command line."""

from collections.abc import Sequence

from mtm_audit.commands.entry import run_program


def main(arguments: Sequence[str] | None = None) -> None:
    """Run one command and leave with its exit code; a missing library or an early interrupt is one sentence."""
    run_program("mtm-audit", "audit", "mtm_audit.cli", arguments)


if __name__ == "__main__":
    main()
