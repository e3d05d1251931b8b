"""`python -m mtm_onboard` is `mtm-onboard`."""

import sys

from mtm_onboard.cli import main

sys.exit(main())
