"""Builds the Debian package of mtm_onboard: `make deb` writes dist/mtm-onboard_VERSION_all.deb.

An argument names another folder than dist. Only the robot's side is packaged. The tree is laid out here and handed to
dpkg-deb; times come from the newest commit, so that the same commit gives the same bytes.
"""

import hashlib
import os
import shutil
import subprocess
import sys
import tempfile
import tomllib
from pathlib import Path

from setuptools_scm import get_version

ROOT = Path(__file__).resolve().parents[1]
HERE = ROOT / "packaging"
NAME = "mtm-onboard"
DEPENDS = "python3 (>= 3.11), python3-numpy, python3-can, python3-serial, adduser, iproute2"

LAUNCHER = """#!/usr/bin/python3
import sys

from mtm_onboard.__main__ import main

sys.exit(main())
"""
COPYRIGHT = """Format: https://www.debian.org/doc/packaging-manuals/copyright-format/1.0/

Files: *
Copyright: the MTM authors
License: Expat
"""


def main() -> None:
    """Lay the package's tree out and build it."""
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    version = debian_version(get_version(ROOT, fallback_version="0.0"))
    out = (Path(sys.argv[1]) if sys.argv[1:] else ROOT / "dist").resolve() / f"{NAME}_{version}_all.deb"
    out.parent.mkdir(exist_ok=True)
    with tempfile.TemporaryDirectory() as folder:
        tree = Path(folder)
        lay_out(tree)
        write_control(tree, version, str(project["description"]))
        build(tree, out)
    print(f"wrote {out}")


def debian_version(version: str) -> str:
    """The same version in Debian's order, where only what follows a tilde comes before its release."""
    return version.replace(".dev", "~dev").replace("rc", "~rc")


def lay_out(tree: Path) -> None:
    """The files as they will be installed."""
    package = tree / "usr/lib/python3/dist-packages/mtm_onboard"
    shutil.copytree(ROOT / "mtm_onboard", package, ignore=shutil.ignore_patterns("__pycache__", "*.pyc"))
    place(tree / "usr/bin" / NAME, LAUNCHER, 0o755)
    for unit in sorted((HERE / "systemd").iterdir()):
        place(tree / "lib/systemd/system" / unit.name, unit.read_text(encoding="utf-8"))
    place(tree / "lib/udev/rules.d/60-mtm.rules", (HERE / "udev/60-mtm.rules").read_text(encoding="utf-8"))
    documents = tree / "usr/share/doc" / NAME
    licence = (ROOT / "LICENSE").read_text(encoding="utf-8")
    indented = "".join(f" {line or '.'}\n" for line in licence.splitlines())
    place(documents / "copyright", COPYRIGHT + indented)
    for page in ("README.md", *(f"docs/{name}.md" for name in ("onboard", "doctor", "failsafes", "journal"))):
        place(documents / page, (ROOT / page).read_text(encoding="utf-8"))
    for example in (*sorted((ROOT / "examples/robots").iterdir()), HERE / "cloud-init/user-data.yaml"):
        place(documents / "examples" / example.name, example.read_text(encoding="utf-8"))
    (tree / "etc/mtm").mkdir(parents=True)


def place(path: Path, text: str, mode: int = 0o644) -> None:
    """Write one file of the tree."""
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(text, encoding="utf-8")
    path.chmod(mode)


def write_control(tree: Path, version: str, description: str) -> None:
    """The DEBIAN folder: control, checksums, and what runs at installation and removal."""
    files = sorted(path for path in tree.rglob("*") if path.is_file())
    size_kib = -(-sum(path.stat().st_size for path in files) // 1024)
    sums = "".join(f"{hashlib.md5(path.read_bytes()).hexdigest()}  {path.relative_to(tree)}\n" for path in files)
    control = (
        f"Package: {NAME}\nVersion: {version}\nArchitecture: all\nMaintainer: the MTM authors <mtm@localhost>\n"
        f"Installed-Size: {size_kib}\nDepends: {DEPENDS}\nSection: science\nPriority: optional\n"
        f"Description: {description.split(':', 1)[0]}\n"
        " The runtime on the robot's companion computer: base commands in, base commands with a keyed message in the\n"
        " motion's noise out, within limits, and a stop whenever something is wrong.\n"
    )
    place(tree / "DEBIAN/control", control)
    place(tree / "DEBIAN/md5sums", sums)
    for script in ("postinst", "prerm", "postrm"):
        place(tree / "DEBIAN" / script, (HERE / "debian" / script).read_text(encoding="utf-8"), 0o755)


def build(tree: Path, out: Path) -> None:
    """Run dpkg-deb; root owns everything."""
    for path in [tree, *tree.rglob("*")]:
        if path.is_dir():
            path.chmod(0o755)
    try:
        subprocess.run(
            ["dpkg-deb", "--build", "--root-owner-group", str(tree), str(out)],
            check=True, stdout=subprocess.DEVNULL, env={**os.environ, "SOURCE_DATE_EPOCH": commit_time()},
        )  # fmt: skip
    except FileNotFoundError:
        sys.exit("dpkg-deb is not here; build on Debian or Ubuntu, or install dpkg")


def commit_time() -> str:
    """Seconds since the Unix epoch of the newest commit; a released archive without git has a fixed one."""
    try:
        asked = ["git", "-C", str(ROOT), "log", "-1", "--format=%ct"]
        return subprocess.run(asked, check=True, capture_output=True, text=True).stdout.strip()
    except (FileNotFoundError, subprocess.CalledProcessError):
        return "0"


if __name__ == "__main__":
    main()
