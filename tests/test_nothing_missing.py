"""`--nothing-missing` lets a skip by design pass, and no other."""

import pytest

pytest_plugins = "pytester"

MODULE = """
import pytest
{line}
def test_one():
    pytest.skip("{reason}")
"""


@pytest.mark.parametrize(
    ("line", "reason", "outcome"),
    [
        ("", "this rig has no brake", {"skipped": 1}),
        ("", "gcc is not installed", {"failed": 1}),
        ("@pytest.mark.skipif(True, reason='no gcc')", "", {"errors": 1}),
        ("pytest.importorskip('no_such_package')", "", {"errors": 1}),
    ],
)
def test_a_skip_for_something_missing_fails(pytester, request, line, reason, outcome):
    pytester.makeconftest((request.config.rootpath / "tests/conftest.py").read_text())
    pytester.makepyfile(MODULE.format(line=line, reason=reason))
    pytester.runpytest("-p", "no:cacheprovider", "--nothing-missing").assert_outcomes(**outcome)
    pytester.runpytest("-p", "no:cacheprovider").assert_outcomes(skipped=1)
