"""The computer: its clock, its processors, and how late its loop wakes."""

from pathlib import Path

from mtm_onboard.doctor.finding import Finding
from mtm_onboard.model.clock import SystemClock
from mtm_onboard.protocol import Scheme
from mtm_onboard.runtime.config import RealtimeSettings
from mtm_onboard.runtime.loop import LoopStats, run_loop
from mtm_onboard.runtime.realtime import realtime

# Phase errors at the band's top, in degrees: 15 make no difference to the decoding, from 45 on coherence drops.
_WARN_DEG, _FAIL_DEG = 15.0, 45.0
_LEAD_S = 0.05
_GOVERNORS = "cpu[0-9]*/cpufreq/scaling_governor"
_PROCESSORS = Path("/sys/devices/system/cpu")


def check_clock(schedule: str, synchronised: bool | None) -> Finding:
    """Check the time of day: a rolling schedule needs it, a fixed one only to start robots together."""
    if synchronised:
        return Finding("clock", "pass", "the system's clock is synchronised")
    found = "the system does not report that it is" if synchronised is None else "it is not"
    remedy = "install chrony (with rtcsync in its configuration) or enable systemd-timesyncd"
    if schedule == "rolling":
        return Finding(
            "clock", "warn" if synchronised is None else "fail",
            f"the rolling schedule needs a synchronised clock and {found}; {remedy}",
        )  # fmt: skip
    return Finding(
        "clock", "warn",
        f"the clock should be synchronised and {found}: robots started together with --start-at begin apart; {remedy}",
    )  # fmt: skip


def check_processors(folder: Path = _PROCESSORS) -> Finding:
    """Check that no processor saves power by running slowly."""
    governors = [path.read_text(encoding="ascii").strip() for path in sorted(folder.glob(_GOVERNORS))]
    slow = governors.count("powersave")
    if slow:
        return Finding(
            "processors", "warn",
            f"{slow} of {len(governors)} have the governor powersave, which makes the loop late; "
            "run: cpupower frequency-set -g performance",
        )  # fmt: skip
    if not governors:
        return Finding("processors", "pass", "the system does not change their frequency")
    return Finding("processors", "pass", f"governor {', '.join(sorted(set(governors)))}")


def check_loop(settings: RealtimeSettings, scheme: Scheme, duration_s: float) -> list[Finding]:
    """Run an empty loop at the scheme's rate under [realtime]: which settings are refused, how late it wakes."""
    refused: list[str] = []
    clock, stats = SystemClock(), LoopStats()
    with realtime(settings, refused.append):
        start_s = clock.now() + _LEAD_S
        run_loop(
            clock, scheme.rate_hz, lambda tick, now_s, late_s: None, start_s=start_s, stats=stats,
            stop=lambda: clock.now() >= start_s + duration_s,
        )  # fmt: skip
    return [_realtime_finding(settings, refused), lateness_finding(stats, scheme)]


def _realtime_finding(settings: RealtimeSettings, refused: list[str]) -> Finding:
    if refused:
        return Finding("realtime", "warn", refused[0])
    if settings == RealtimeSettings():
        return Finding("realtime", "pass", "nothing is asked for")
    return Finding("realtime", "pass", "all that [realtime] asks for is granted")


def lateness_finding(stats: LoopStats, scheme: Scheme) -> Finding:
    """The delays of the loop's wake-ups as phase errors of the noise at the top of its band."""
    late, top_hz = stats.lateness, scheme.band_hz[1]
    delays_s = {"p50": late.quantile_s(0.5), "p99": late.quantile_s(0.99), "max": late.worst_s}
    phases_deg = {name: 360.0 * top_hz * delay_s for name, delay_s in delays_s.items()}
    figures = {f"late_{name}_ms": round(1e3 * delay_s, 3) for name, delay_s in delays_s.items()}
    figures |= {f"phase_{name}_deg": round(phase_deg, 2) for name, phase_deg in phases_deg.items()}
    figures |= {"ticks": stats.sent, "missed": stats.missed}
    text = (
        f"wakes {1e3 * delays_s['p50']:.2f} ms late (p50), {1e3 * delays_s['p99']:.2f} ms (p99), "
        f"{1e3 * delays_s['max']:.2f} ms at most in {stats.sent} ticks: "
        f"{phases_deg['p99']:.1f} degrees of phase at {top_hz:g} Hz (p99)"
    )
    if phases_deg["p99"] <= _WARN_DEG:
        return Finding("loop", "pass", text, figures)
    remedy = "end what else runs here, and give the loop a priority and a cpu in [realtime]"
    return Finding("loop", "fail" if phases_deg["p99"] > _FAIL_DEG else "warn", f"{text}; {remedy}", figures)
