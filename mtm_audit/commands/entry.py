"""What comes before a program's command line is loaded."""

import os
import signal
import sys
from collections.abc import Sequence
from importlib import import_module


def run_program(name: str, extra: str, module: str, arguments: Sequence[str] | None) -> None:
    """Run `main` of a command line's module and leave with its exit code.

    A library of the `extra` that is missing, a closed standard output and an early interrupt are one sentence each.
    """

    def leave(*_: object) -> None:
        # An exception could come out of a half-loaded module as another one.
        os.write(2, f"{name}: interrupted; nothing was written\n".encode())
        os._exit(130)

    former = signal.getsignal(signal.SIGINT)
    # Whoever started this with interrupts ignored, as a shell does in the background, wants them ignored.
    if former is signal.default_int_handler:
        signal.signal(signal.SIGINT, leave)
    try:
        run = import_module(module).main
        signal.signal(signal.SIGINT, former)
        if sys.stdout is None:
            print(f"{name}: standard output is closed; let it go somewhere, such as >/dev/null", file=sys.stderr)
            sys.exit(1)
        run(arguments)
    except ModuleNotFoundError as error:
        from mtm_onboard.protocol.installing import missing_sentence

        print(f"{name}: {missing_sentence(error, name, extra)}", file=sys.stderr)
        raise SystemExit(1) from None
