"""`mtm-onboard` and `python -m mtm_onboard`: what comes before the command line."""

import sys

from mtm_onboard.loading import interruptible_loading


def main() -> int:
    """Run one command and return its exit code; an interrupt while it loads is no traceback either."""
    with interruptible_loading("mtm-onboard"):
        from mtm_onboard.cli import main as run
    if sys.stdout is None:
        print("mtm-onboard: standard output is closed; let it go somewhere, such as >/dev/null", file=sys.stderr)
        return 1
    return run()


if __name__ == "__main__":
    sys.exit(main())
