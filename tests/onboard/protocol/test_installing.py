import re
import tomllib
from pathlib import Path

import pytest

from mtm_onboard.protocol import installing
from mtm_onboard.protocol.installing import DISTRIBUTION, install_command, missing_sentence

ROOT = Path(__file__).parents[3]
DEBIAN_FILE = "/usr/lib/python3/dist-packages/mtm_onboard/protocol/installing.py"


def test_a_library_comes_with_an_extra_of_the_distribution():
    assert install_command("can") == "pip install 'messages-through-motion[can]'"


@pytest.mark.parametrize(("extra", "command"), [("can", "apt install python3-can"), ("audit", "pip install 'mess")])
def test_in_the_debian_package_it_comes_from_debian_where_it_can(monkeypatch, extra, command):
    monkeypatch.setattr(installing, "__file__", DEBIAN_FILE)
    assert install_command(extra).startswith(command)


def test_a_program_says_which_library_it_lacks():
    error = ModuleNotFoundError("No module named 'typer.core'", name="typer.core")
    sentence = missing_sentence(error, "mtm-audit", "audit")
    assert sentence.startswith("mtm-audit needs typer, which is not installed; install it with: pip install ")


def test_a_missing_module_of_our_own_is_no_missing_library():
    error = ModuleNotFoundError("No module named 'hil.gone'", name="hil.gone")
    with pytest.raises(ModuleNotFoundError, match="hil.gone"):
        missing_sentence(error, "mtm-hil", "hil")


def test_no_text_names_the_stranger_s_package_mtm():
    texts = [
        path
        for folder in ("mtm_onboard", "mtm_audit", "hil", "docs", "firmware_shim", "packaging", "examples")
        for path in (ROOT / folder).rglob("*")
        if path.suffix in (".py", ".md", ".toml", ".yaml", ".c", ".h")
    ]
    texts += [ROOT / "README.md", ROOT / "pyproject.toml"]
    named = [path for path in texts if re.search(r"\bmtm\[|pip install '?mtm\b", path.read_text(encoding="utf-8"))]
    assert named == []


def test_every_extra_that_is_named_exists():
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    assert project["name"] == DISTRIBUTION
    named = {
        extra
        for folder in ("mtm_onboard", "mtm_audit", "hil")
        for path in (ROOT / folder).rglob("*.py")
        for extra in re.findall(r"install_command\(['\"](\w+)['\"]\)", path.read_text(encoding="utf-8"))
    }
    assert {"can", "serial", "mavlink", "audit", "hil", "worlds"} <= named <= set(project["optional-dependencies"])
