"""How a missing library is installed: from the distribution's extras, or from Debian where the package is Debian's."""

DISTRIBUTION = "messages-through-motion"
# Where the Debian package lies. Its Python takes no pip installation, and Debian has no pymavlink.
_DEBIAN_FOLDER = "/usr/lib/python3/dist-packages"
_DEBIAN_COMMANDS = {
    "can": "apt install python3-can",
    "serial": "apt install python3-serial",
    "mavlink": "pip install --break-system-packages pymavlink",
}


def install_command(extra: str) -> str:
    """The shell command that installs what the named extra of the distribution brings."""
    if __file__.startswith(f"{_DEBIAN_FOLDER}/") and extra in _DEBIAN_COMMANDS:
        return _DEBIAN_COMMANDS[extra]
    return f"pip install '{DISTRIBUTION}[{extra}]'"


def missing_sentence(error: ModuleNotFoundError, program: str, extra: str) -> str:
    """One sentence for a program that cannot start; raises `error` when the missing module is the project's own."""
    library = (error.name or "").partition(".")[0]
    if library in ("", "mtm_onboard", "mtm_audit", "hil"):
        raise error
    return f"{program} needs {library}, which is not installed; install it with: {install_command(extra)}"
