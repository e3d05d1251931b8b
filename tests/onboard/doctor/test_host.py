import pytest

from hil.fleet.clock import SimulatedClock
from mtm_onboard.doctor import host
from mtm_onboard.doctor.host import check_clock, check_loop, check_processors, lateness_finding
from mtm_onboard.runtime.config import RealtimeSettings
from mtm_onboard.runtime.loop import LoopStats
from tests.onboard.schemes import small_scheme

SCHEME = small_scheme(band_hz=(0.5, 5.0))


def test_only_a_rolling_schedule_needs_a_synchronised_clock():
    assert [check_clock("rolling", state).status for state in (True, False, None)] == ["pass", "fail", "warn"]
    assert [check_clock("fixed", state).status for state in (True, False, None)] == ["pass", "warn", "warn"]


@pytest.mark.parametrize(
    ("governors", "status"),
    [([], "pass"), (["performance"] * 2, "pass"), (["schedutil", "powersave"], "warn")],
)
def test_processors_that_save_power_are_a_warning(tmp_path, governors, status):
    for number, governor in enumerate(governors):
        place = tmp_path / f"cpu{number}" / "cpufreq"
        place.mkdir(parents=True)
        (place / "scaling_governor").write_text(f"{governor}\n")
    assert check_processors(tmp_path).status == status


@pytest.mark.parametrize(("late_ms", "status"), [(1.0, "pass"), (8.0, "pass"), (10.0, "warn"), (30.0, "fail")])
def test_lateness_is_judged_as_phase_at_the_top_of_the_band(late_ms, status):
    stats = LoopStats()
    for _ in range(100):
        stats.lateness.record(late_ms * 1e-3)
    finding = lateness_finding(stats, SCHEME)
    assert finding.status == status
    assert finding.figures["phase_p99_deg"] == pytest.approx(1.8 * late_ms, rel=0.13)
    assert finding.figures["late_max_ms"] == late_ms
    assert (";" in finding.text) == (status != "pass")


def test_a_single_late_tick_among_many_is_told_and_forgiven():
    stats = LoopStats()
    for tick in range(1000):
        stats.lateness.record(0.5 if tick == 7 else 1e-4)
    finding = lateness_finding(stats, SCHEME)
    assert finding.status == "pass"
    assert "500.00 ms at most" in finding.text


def test_the_loop_is_watched_as_long_as_asked(monkeypatch):
    monkeypatch.setattr(host, "SystemClock", SimulatedClock)
    realtime, loop = check_loop(RealtimeSettings(cpu=1023), SCHEME, 0.2)
    assert realtime.status == "warn"
    assert "cpu 1023" in realtime.text
    # Two before the start, and ten in a fifth of a second.
    assert (loop.figures["ticks"], loop.figures["missed"]) == (12, 0)
    realtime, _ = check_loop(RealtimeSettings(), SCHEME, 0.02)
    assert realtime.status == "pass"
