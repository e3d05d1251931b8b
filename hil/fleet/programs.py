"""The project's own programs, as a user would call them."""

import sysconfig
from pathlib import Path

from mtm_onboard.protocol import MtmError
from mtm_onboard.protocol.installing import install_command

# Numerical libraries read these when they are loaded. Where several processes compute at once, more threads than
# cores only get in each other's way.
SINGLE_THREADED = {"OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1", "MKL_NUM_THREADS": "1"}


def program(name: str) -> str:
    """Path of an installed program such as mtm-audit; raises MtmError when it is not there."""
    path = Path(sysconfig.get_path("scripts")) / name
    if not path.is_file():
        raise MtmError(f"{name} is not installed beside mtm-hil; install both with: {install_command('hil')}")
    return str(path)
