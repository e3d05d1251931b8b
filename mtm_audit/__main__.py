"""`mtm-audit` and `python -m mtm_audit`: the command line, or one sentence when a library is missing."""

import sys
from collections.abc import Sequence


def main(arguments: Sequence[str] | None = None) -> None:
    """Run one command; leaves through SystemExit with the exit code."""
    try:
        from mtm_audit import cli

        cli.main(arguments)
    except ModuleNotFoundError as error:
        from mtm_onboard.protocol.installing import missing_sentence

        print(f"mtm-audit: {missing_sentence(error, 'mtm-audit', 'audit')}", file=sys.stderr)
        raise SystemExit(1) from None


if __name__ == "__main__":
    main()
