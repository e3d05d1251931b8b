"""Installs the peers, each group into an environment of its own under .peers: `python tests/peers/install.py`.

What cannot be installed on this machine is no error: .peers/GROUP.reason then says why, and the group's tests are
skipped with it. A group is installed anew when its requirements change.
"""

import shutil
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
PEERS = ROOT / ".peers"
REQUIREMENTS = Path(__file__).parent / "requirements"
_PATIENCE_S = 1800


def main() -> None:
    """Install every group whose requirements are not what is installed."""
    PEERS.mkdir(exist_ok=True)
    for requirements in sorted(REQUIREMENTS.glob("*.txt")):
        group, wanted = requirements.stem, requirements.read_text(encoding="utf-8")
        stamp, reason = PEERS / f"{group}.installed", PEERS / f"{group}.reason"
        if stamp.exists() and stamp.read_text(encoding="utf-8") == wanted:
            continue
        shutil.rmtree(PEERS / group, ignore_errors=True)
        try:
            INSTALLERS.get(group, install_python)(PEERS / group, requirements)
        except (OSError, subprocess.SubprocessError) as error:
            reason.write_text(because(error), encoding="utf-8")
            print(f"{group}: not installed, {because(error)}")
        else:
            reason.unlink(missing_ok=True)
            stamp.write_text(wanted, encoding="utf-8")
            print(f"{group}: installed")


def install_python(folder: Path, requirements: Path) -> None:
    """An environment with the packages that are named line by line."""
    run(sys.executable, "-m", "venv", folder)
    run(folder / "bin/python", "-m", "pip", "install", "--quiet", "--disable-pip-version-check", "-r", requirements)


def install_node(folder: Path, requirements: Path) -> None:
    """The packages that are named line by line, for the Node.js that is here."""
    folder.mkdir()
    run("npm", "install", "--silent", "--no-fund", "--no-audit", "--prefix", folder, *requirements.read_text().split())


def unpack_dji(folder: Path, requirements: Path) -> None:
    """DJI's package, whose one wheel is for Python 3.8; its codec is pure Python and needs nothing else."""
    run(
        sys.executable, "-m", "pip", "install", "--quiet", "--disable-pip-version-check", "--no-deps", "--no-compile",
        "--only-binary", ":all:", "--python-version", "3.8", "--implementation", "cp", "--abi", "cp38",
        "--platform", "manylinux2014_x86_64", "--target", folder, "-r", requirements,
    )  # fmt: skip


def run(*command: object) -> None:
    """Run a command and raise what it said last when it fails."""
    subprocess.run(
        list(map(str, command)), check=True, stdin=subprocess.DEVNULL, stderr=subprocess.PIPE, timeout=_PATIENCE_S
    )


def because(error: OSError | subprocess.SubprocessError) -> str:
    """The last line of what the installer said, or what kept it from running."""
    said = (getattr(error, "stderr", None) or b"").decode(errors="replace").strip().splitlines()
    return said[-1] if said else str(error)


INSTALLERS = {"node": install_node, "dji": unpack_dji}

if __name__ == "__main__":
    main()
