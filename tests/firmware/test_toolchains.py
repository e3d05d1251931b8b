"""What `make` promises in firmware_shim, as far as this machine has the tools."""

import re
import shutil
import subprocess
from pathlib import Path

import pytest

# CI installs the compilers and the emulator for `make test-all` alone.
pytestmark = pytest.mark.long

SHIM = Path(__file__).resolve().parents[2] / "firmware_shim"


def make(*arguments):
    if shutil.which("make") is None:
        pytest.skip("make is not installed")
    command = ["make", "--no-print-directory", "-C", str(SHIM), *arguments]
    return subprocess.run(command, capture_output=True, text=True, timeout=300, check=False)


def needs(*tools):
    missing = [tool for tool in tools if shutil.which(tool) is None]
    return pytest.mark.skipif(bool(missing), reason=f"{', '.join(missing)} not installed; see firmware_shim/README.md")


@needs("gcc", "gcov")
def test_every_line_and_branch_of_guard_and_limits_is_tested():
    result = make("coverage")
    assert result.returncode == 0, result.stdout + result.stderr


@needs("arm-none-eabi-gcc")
def test_the_cortex_m4_code_keeps_its_sizes_and_calls_no_library():
    result = make("size")
    assert result.returncode == 0, result.stdout + result.stderr
    assert re.search(r"playing core: \d+ bytes", result.stdout)


@needs("gcc", "arm-none-eabi-gcc", "qemu-system-arm")
def test_a_cortex_m4_in_qemu_agrees_with_every_vector():
    result = make("qemu")
    assert result.returncode == 0, result.stdout + result.stderr
    assert "all vectors agree" in result.stdout


@pytest.mark.parametrize("target", [("cortex", "ARM=no-such"), ("host", "CLANG=no-such-clang")])
def test_a_missing_compiler_is_named_with_what_to_install(target, tmp_path):
    result = make(*target, f"BUILD={tmp_path.name}")
    shutil.rmtree(SHIM / tmp_path.name, ignore_errors=True)
    assert result.returncode != 0
    assert re.search(r"^no-such\S* is missing; install it with: apt install \S+", result.stderr, re.MULTILINE)


def test_the_readmes_examples_compile(tmp_path):
    blocks = re.findall(r"```c\n(.*?)```", (SHIM / "README.md").read_text(), re.DOTALL)
    assert len(blocks) == 2
    compiler = shutil.which("cc") or shutil.which("gcc") or shutil.which("clang")
    for number, block in enumerate(blocks):
        source = tmp_path / f"example_{number}.c"
        source.write_text(block)
        warnings = ["-std=c99", "-Wall", "-Wextra", "-Wconversion", "-Werror"]
        subprocess.run(
            [compiler, *warnings, "-I", str(SHIM / "include"), "-c", str(source), "-o", str(tmp_path / "example.o")],
            check=True,
        )
