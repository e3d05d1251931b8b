"""`mtm-onboard` and `python -m mtm_onboard`: what comes before the command line."""

import os
import signal
import sys


def main() -> int:
    """Run one command and return its exit code; an interrupt while it loads is no traceback either."""
    former = signal.getsignal(signal.SIGINT)
    # Whoever started this with interrupts ignored, as a shell does in the background, wants them ignored.
    if former is signal.default_int_handler:
        signal.signal(signal.SIGINT, _leave)
    from mtm_onboard.cli import main as run

    signal.signal(signal.SIGINT, former)
    if sys.stdout is None:
        print("mtm-onboard: standard output is closed; let it go somewhere, such as >/dev/null", file=sys.stderr)
        return 1
    return run()


def _leave(*_: object) -> None:
    # An exception could come out of a half-loaded module as another one.
    os.write(2, b"mtm-onboard: interrupted; nothing was written\n")
    os._exit(130)


if __name__ == "__main__":
    sys.exit(main())
