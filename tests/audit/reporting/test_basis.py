from dataclasses import replace
from datetime import UTC, datetime, timedelta

import pytest

from mtm_audit.decoding.decode import decode_tracks
from mtm_audit.decoding.settings import DecodeSettings
from mtm_audit.reporting.basis import FIXED, Disclosure, basis_of
from tests.audit.moving_robot import key_of, robot_track, scheme_of

KEY = key_of(scheme_of(ticks=400, symbols=(2,)))
PUBLIC_FROM = datetime(2026, 12, 1, 1, tzinfo=UTC)
HOUR = timedelta(hours=1)


@pytest.fixture(scope="module")
def decoding():
    track = robot_track(KEY, "robot0", (3, 1), 18.0, onset_s=1.0)
    return decode_tracks([track], KEY, DecodeSettings(onset_s=1.0))


def test_a_fixed_schedule_is_told_unless_nothing_is_there(decoding):
    assert decoding.verdict == "decoded"
    assert basis_of(decoding, None, None).sentences == (FIXED,)
    assert basis_of(replace(decoding, verdict="inconclusive"), None, None).sentences == (FIXED,)
    assert basis_of(replace(decoding, verdict="absent"), None, None).sentences == ()


@pytest.mark.parametrize(
    ("stated", "written", "authenticates"),
    [(True, PUBLIC_FROM - HOUR, True), (False, PUBLIC_FROM - HOUR, True), (True, PUBLIC_FROM + HOUR, True),
     (False, PUBLIC_FROM, False), (False, PUBLIC_FROM + HOUR, False)],
)  # fmt: skip
def test_a_film_that_only_its_file_dates_proves_nothing(decoding, stated, written, authenticates):
    rolling = replace(decoding, scheme=replace(KEY.scheme, schedule="rolling"))
    basis = basis_of(rolling, None, Disclosure(PUBLIC_FROM, stated, written))
    assert basis.authenticates is authenticates
    assert ("proves nothing by itself" in basis.sentences[0]) is not authenticates
