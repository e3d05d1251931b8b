import importlib.util
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]

pytestmark = pytest.mark.skipif(shutil.which("dpkg-deb") is None, reason="dpkg-deb is not here")


@pytest.fixture(scope="module")
def package(tmp_path_factory):
    """The built package and the tree that it installs."""
    built = build(tmp_path_factory.mktemp("deb"))
    tree = tmp_path_factory.mktemp("tree")
    subprocess.run(["dpkg-deb", "--extract", built, tree], check=True)
    return built, tree


def build(folder):
    subprocess.run([sys.executable, ROOT / "packaging/build_deb.py", folder], check=True, capture_output=True)
    (built,) = folder.glob("mtm-onboard_*_all.deb")
    return built


def field(built, name):
    return subprocess.run(["dpkg-deb", "-f", built, name], check=True, capture_output=True, text=True).stdout.strip()


def test_it_is_for_every_architecture_with_debians_libraries(package):
    built, _ = package
    assert field(built, "Architecture") == "all"
    assert {"python3-numpy", "python3-can", "python3-serial"} <= set(field(built, "Depends").split(", "))


def test_it_holds_the_whole_runtime_and_nothing_of_the_auditors(package):
    _, tree = package
    installed = tree / "usr/lib/python3/dist-packages"
    ours = {path.relative_to(ROOT) for path in (ROOT / "mtm_onboard").rglob("*.py")}
    assert {path.relative_to(installed) for path in installed.rglob("*.py")} == ours


def test_the_installed_program_starts(package):
    _, tree = package
    environment = {"PYTHONPATH": str(tree / "usr/lib/python3/dist-packages")}
    launched = [sys.executable, "-P", tree / "usr/bin/mtm-onboard", "--help"]
    shown = subprocess.run(launched, check=True, capture_output=True, text=True, env=environment).stdout
    assert "run" in shown
    assert "keygen" in shown


def test_the_same_commit_gives_the_same_bytes(package, tmp_path):
    built, _ = package
    assert build(tmp_path).read_bytes() == built.read_bytes()


def test_the_service_names_only_options_that_the_program_has(package):
    _, tree = package
    unit = (tree / "lib/systemd/system/mtm-onboard@.service").read_text()
    (command,) = [line for line in unit.splitlines() if line.startswith("ExecStart=")]
    options = {word for word in command.split() if word.startswith("--")} | {"--no-message"}
    environment = {"PYTHONPATH": str(ROOT)}
    asked = [sys.executable, "-m", "mtm_onboard", "run", "--help"]
    shown = subprocess.run(asked, capture_output=True, text=True, env=environment).stdout
    assert options <= set(shown.replace(",", " ").replace("[", " ").replace("]", " ").split())


@pytest.mark.skipif(shutil.which("systemd-analyze") is None, reason="systemd-analyze is not here")
@pytest.mark.parametrize("unit", ["mtm-onboard@.service", "mtm-can@.service"])
def test_systemd_understands_the_units(package, unit):
    _, tree = package
    path = tree / "lib/systemd/system" / unit
    asked = ["systemd-analyze", "verify", "--man=no", "--recursive-errors=no", path]
    said = subprocess.run(asked, capture_output=True, text=True).stderr
    complaints = [
        line for line in said.splitlines() if path.name.split("@")[0] in line and "not executable" not in line
    ]
    assert complaints == []


@pytest.mark.parametrize(
    ("earlier", "later"), [("1.2.dev3+gabc", "1.2"), ("1.2rc1", "1.2"), ("1.2.dev3", "1.2.dev12"), ("1.2", "1.3.dev1")]
)
def test_a_version_before_a_release_is_before_it_in_debian(earlier, later):
    spec = importlib.util.spec_from_file_location("build_deb", ROOT / "packaging/build_deb.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    order = ["dpkg", "--compare-versions", module.debian_version(earlier), "lt", module.debian_version(later)]
    assert subprocess.run(order).returncode == 0
