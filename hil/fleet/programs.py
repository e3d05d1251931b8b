"""The project's installed programs."""

import sysconfig
from pathlib import Path

from mtm_onboard.protocol import MtmError
from mtm_onboard.protocol.installing import install_command


def program(name: str) -> str:
    """Path of an installed program such as mtm-audit; raises MtmError when it is not there."""
    path = Path(sysconfig.get_path("scripts")) / name
    if not path.is_file():
        raise MtmError(f"{name} is not installed beside mtm-hil; install both with: {install_command('hil')}")
    return str(path)
