"""`python -m mtm_onboard` is `mtm-onboard`."""

import sys

from mtm_onboard.cli import main

if __name__ == "__main__":
    sys.exit(main())
