"""`mtm-audit` and `python -m mtm_audit`: what comes before the command line."""

import os
import signal
import sys
from collections.abc import Sequence


def main(arguments: Sequence[str] | None = None) -> None:
    """Run one command and leave with its exit code; a missing library or an early interrupt is one sentence."""
    former = signal.getsignal(signal.SIGINT)
    # Whoever started this with interrupts ignored, as a shell does in the background, wants them ignored.
    if former is signal.default_int_handler:
        signal.signal(signal.SIGINT, _leave)
    try:
        from mtm_audit.cli import main as run

        signal.signal(signal.SIGINT, former)
        if sys.stdout is None:
            print("mtm-audit: standard output is closed; let it go somewhere, such as >/dev/null", file=sys.stderr)
            sys.exit(1)
        run(arguments)
    except ModuleNotFoundError as error:
        from mtm_onboard.protocol.installing import missing_sentence

        print(f"mtm-audit: {missing_sentence(error, 'mtm-audit', 'audit')}", file=sys.stderr)
        raise SystemExit(1) from None


def _leave(*_: object) -> None:
    # An exception could come out of a half-loaded module as another one.
    os.write(2, b"mtm-audit: interrupted; nothing was written\n")
    os._exit(130)


if __name__ == "__main__":
    main()
