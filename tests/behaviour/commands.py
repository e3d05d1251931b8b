"""The commands whose outputs must stay as they are, in the order in which they run."""

from dataclasses import dataclass

_MOCAP = tuple(f"out/mocap/robot{number}.tum" for number in range(4))


@dataclass(frozen=True)
class Command:
    """One command line, run in a fresh folder beside those of the others and of the inputs.

    `writes` are the files to compare; others are listed and no more. `ends_with` is the exit code. `copies` are files
    of earlier commands, (from, to), for commands that want them under other names.
    """

    name: str
    line: str
    writes: tuple[str, ...] = ()
    ends_with: int = 0
    copies: tuple[tuple[str, str], ...] = ()

    @property
    def argv(self) -> tuple[str, ...]:
        """The program and its arguments."""
        return tuple(self.line.split())


# Left out, since they differ from run to run: keygen and records without --key (the secret is fresh), run, doctor and
# record --realtime (the wall clock), fuzz and endurance (elapsed times and memory).
# Cells are not compared: each line holds the fingerprint of the code, which every move changes.
COMMANDS = (
    Command("onboard-help", "mtm-onboard --help"),
    Command("onboard-show", "mtm-onboard show --key ../inputs/courier.key"),
    Command(
        "onboard-export",
        "mtm-onboard export --key ../inputs/courier.key --channel robot2 --message 99 --messages 3 --first-message 7 "
        "--out robot2.image",
        writes=("robot2.image",),
    ),
    Command("hil-help", "mtm-hil --help"),
    Command("hil-record-help", "mtm-hil record --help"),
    Command(
        "hil-record-can",
        "mtm-hil record --out out --message 178 --key ../inputs/fleet.key --seconds 11 --seed 1",
        writes=(*_MOCAP, "out/truth.json", "out/video.mp4"),
    ),
    Command(
        "hil-record-direct",
        "mtm-hil record --out out --message 99 --key ../inputs/courier.key --seconds 14 --seed 2 --wire direct "
        "--no-video",
        writes=(*_MOCAP, "out/truth.json"),
    ),
    Command(
        "hil-sweep",
        "mtm-hil sweep lunar-lander -n 2 --alphabet 4 --window 60 --window 90 --workers 1 --out table.csv "
        "--cells cells.jsonl",
        writes=("table.csv",),
    ),
    Command(
        "hil-paper",
        "mtm-hil paper robomaster -n 2 --out paper.csv --cells cells.jsonl",
        writes=("paper.csv",),
    ),
    Command("hil-bench", "mtm-hil bench --quick --out bench.csv --cells cells.jsonl", writes=("bench.csv",)),
    Command(
        "hil-robustness",
        "mtm-hil robustness -n 1 --workers 1 --out robustness.csv --cells cells.jsonl",
        writes=("robustness.csv",),
    ),
    Command(
        "hil-false-alarms",
        "mtm-hil false-alarms -n 4 --detector coherency --workers 1 --out alarms.csv --cells cells.jsonl",
        writes=("alarms.csv",),
    ),
    Command(
        "hil-frames",
        "mtm-hil frames -n 200 --workers 1 --out frames.csv --cells cells.jsonl",
        writes=("frames.csv",),
    ),
    Command("audit-help", "mtm-audit --help"),
    Command("audit-decode-help", "mtm-audit decode --help"),
    Command(
        "audit-decode-video",
        "mtm-audit decode ../hil-record-can/out/video.mp4 --key ../inputs/fleet.key --tracker aruco --explain "
        "--plot decode.png",
        writes=("decode.png",),
    ),
    Command(
        "audit-decode-colour",
        "mtm-audit decode ../hil-record-can/out/video.mp4 --key ../inputs/fleet.key "
        "--tracker colour:hsv(0-180,0-60,215-255) --json",
        ends_with=3,
    ),
    Command(
        "audit-decode-unnamed",
        "mtm-audit decode a.tum b.tum c.tum d.tum --key ../inputs/fleet.key --onset 1.5 --json",
        copies=tuple((f"hil-record-can/{path}", f"{name}.tum") for path, name in zip(_MOCAP, "dbac", strict=True)),
    ),
    Command(
        "audit-decode-coherency",
        "mtm-audit decode ../hil-record-can/out/mocap --key ../inputs/fleet.key --detector coherency --onset 1.5 "
        "--explain",
    ),
    Command(
        "audit-decode-wrong-key",
        "mtm-audit decode ../hil-record-can/out/mocap --key ../inputs/other.key --explain",
        ends_with=3,
    ),
    Command(
        "audit-decode-rolling",
        "mtm-audit decode ../hil-record-direct/out/mocap --key ../inputs/courier.key --at 2026-01-31T12:00:01Z "
        "--at-error 2",
    ),
    Command(
        "audit-plan",
        "mtm-audit plan ../inputs/table.csv --bits 8 --accuracy 0.95 --like ../inputs/fleet.key --out plan.toml",
        writes=("plan.toml",),
    ),
    Command("audit-overhead", "mtm-audit overhead"),
    Command("audit-duration", "mtm-audit duration ../inputs/table.csv --key ../inputs/fleet.key"),
    Command(
        "audit-profile",
        "mtm-audit profile ../hil-record-can/out/mocap --key ../inputs/fleet.key --out fleet.profile",
        writes=("fleet.profile",),
    ),
    Command("audit-journal", "mtm-audit journal ../inputs/journal.csv"),
    Command("onboard-bad-key", "mtm-onboard show --key ../inputs/readable-by-all.key", ends_with=1),
    Command("audit-missing-file", "mtm-audit decode missing.mp4 --key ../inputs/fleet.key", ends_with=1),
    Command(
        "audit-unknown-tracker",
        "mtm-audit decode ../hil-record-can/out/video.mp4 --key ../inputs/fleet.key --tracker smell",
        ends_with=1,
    ),
    Command(
        "audit-unreadable-csv",
        "mtm-audit decode ../inputs/unreadable.csv --key ../inputs/fleet.key --explain",
        ends_with=1,
    ),
)
