import pytest

from hil.experiments.messages.jobs import JOBS, payload_bps, receive


def test_a_number_with_a_tag_is_received_by_the_clock_alone():
    assert receive({"job": "64 bits in 32 s"}, 42) == {"received": True, "wrong": False}


def test_the_job_has_the_rate_that_its_name_says():
    assert payload_bps(JOBS["64 bits in 32 s"]) == pytest.approx(2.0)
