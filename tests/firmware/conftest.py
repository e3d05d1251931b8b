import shutil

import pytest


@pytest.fixture(autouse=True)
def _c_compiler():
    if not any(shutil.which(name) for name in ("cc", "gcc", "clang")):
        pytest.skip("no C compiler here; install gcc")
    pytest.importorskip("cffi", reason="the C shim is called through cffi; run make setup")
