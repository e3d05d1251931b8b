"""The microcontroller's C code as a shared library of this host, so that simulations and tests can call it."""

import hashlib
import os
import re
import shutil
import subprocess
import tempfile
from functools import cache
from pathlib import Path
from typing import Any, NamedTuple

from mtm_onboard.protocol.errors import MtmError
from mtm_onboard.protocol.installing import install_command

SOURCES = Path(__file__).resolve().parents[2] / "firmware_shim"
HEADER = SOURCES / "include" / "mtm_shim.h"
_FLAGS = ("-std=c99", "-O2", "-Wall", "-Wextra", "-Wconversion", "-Werror", "-shared", "-fPIC")


class Shim(NamedTuple):
    """The library's functions and constants (`lib`) and cffi's way to make its types (`ffi`)."""

    ffi: Any
    lib: Any


@cache
def load_shim() -> Shim:
    """Compile the sources with the host's C compiler, once for each state of them, and load the result.

    Raises MtmError when there is no compiler, no cffi, no source, or the sources do not compile.
    """
    try:
        from cffi import FFI
    except ImportError as error:
        raise MtmError(
            f"the C shim needs cffi, which is not installed; install it with: {install_command('hil')}"
        ) from error
    if not HEADER.exists():
        raise MtmError(f"the C shim's sources are not in {SOURCES}; run from a checkout of the project")
    ffi = FFI()
    ffi.cdef(_declarations(HEADER.read_text(encoding="utf-8")))
    return Shim(ffi, ffi.dlopen(str(_library())))


def _declarations(header: str) -> str:
    """What cffi parses of the header: its text without comments and preprocessor lines but number constants."""
    text = re.sub(r"/\*.*?\*/", "", header, flags=re.DOTALL)
    text = re.sub(r"#ifdef __cplusplus.*?#endif", "", text, flags=re.DOTALL)
    kept = [line for line in text.splitlines() if not line.startswith("#") or re.fullmatch(r"#define \w+ \d+", line)]
    return "\n".join(kept)


def _library() -> Path:
    compiler = shutil.which("cc") or shutil.which("gcc") or shutil.which("clang")
    if compiler is None:
        raise MtmError("the C shim needs a C compiler; install gcc (Debian: apt install gcc libc6-dev)")
    sources = sorted((SOURCES / "src").glob("*.c"))
    state = hashlib.sha256(repr((compiler, _FLAGS)).encode())
    for path in [HEADER, SOURCES / "src" / "internal.h", *sources]:
        state.update(path.read_bytes())
    folder = Path(tempfile.gettempdir()) / f"mtm-shim-{os.getuid()}"
    folder.mkdir(mode=0o700, exist_ok=True)
    if folder.stat().st_uid != os.getuid():
        raise MtmError(f"{folder} belongs to someone else; remove it or set TMPDIR to a folder of your own")
    library = folder / f"{state.hexdigest()[:16]}.so"
    if not library.exists():
        _compile(compiler, sources, library)
    return library


def _compile(compiler: str, sources: list[Path], library: Path) -> None:
    unfinished = library.with_suffix(f".{os.getpid()}")
    includes = ["-I", str(HEADER.parent), "-I", str(SOURCES / "src")]
    command = [compiler, *_FLAGS, *includes, *map(str, sources), "-o", str(unfinished)]
    result = subprocess.run(command, capture_output=True, text=True, check=False)
    if result.returncode:
        raise MtmError(f"the C shim does not compile; run make -C firmware_shim to see why ({result.stderr[:200]!r})")
    os.replace(unfinished, library)
