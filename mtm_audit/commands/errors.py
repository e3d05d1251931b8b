"""How a command ends badly: one sentence on standard error and an exit code, never a traceback."""

import os
import signal
import sys
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from typing import Never

import typer

# Longer than it takes to remove what was half written.
_AGAIN_S = 5.0


@contextmanager
def reported(program: str, when_interrupted: str) -> Iterator[None]:
    """Turn errors into `program: sentence` and their exit code, an interrupt into `when_interrupted` and 130.

    A request to terminate unwinds like any other exception, so that nothing half-written stays behind.
    """
    from mtm_onboard.protocol.errors import MtmError

    former = signal.signal(signal.SIGTERM, _terminated)
    try:
        yield
        # Here, where it can still be told, and not when the interpreter ends.
        sys.stdout.flush()
    except MtmError as error:
        print(f"{program}: {error}", file=sys.stderr)
        raise typer.Exit(error.exit_code) from error
    except BrokenPipeError as error:
        print(f"{program}: nobody reads the output any more, so its end is lost; let it be read", file=sys.stderr)
        _discard_output()
        raise typer.Exit(1) from error
    except OSError as error:
        print(f"{program}: the system refused ({error}); check disk space and permissions", file=sys.stderr)
        _discard_output()
        raise typer.Exit(1) from error
    except KeyboardInterrupt as error:
        print(f"{program}: interrupted; {when_interrupted}", file=sys.stderr)
        raise typer.Exit(130) from error
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0.0)
        signal.signal(signal.SIGTERM, former)


def _discard_output() -> None:
    """Let what is still buffered for standard output go nowhere, where it cannot fail a second time."""
    with suppress(OSError, ValueError):
        nowhere = os.open(os.devnull, os.O_WRONLY)
        os.dup2(nowhere, sys.stdout.fileno())
        os.close(nowhere)


def _terminated(*_: object) -> Never:
    # An exception that comes up inside a destructor is dropped, and one that comes up between taking a lock and
    # guarding it leaves what closes waiting for that lock. So the request is made again.
    signal.signal(signal.SIGALRM, _terminated)
    signal.setitimer(signal.ITIMER_REAL, _AGAIN_S)
    raise SystemExit(128 + signal.SIGTERM)
