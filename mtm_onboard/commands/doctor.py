"""`mtm-onboard doctor`: what would keep a robot from running well, without moving it."""

import argparse
from pathlib import Path

_SHORTEST_S, _LONGEST_S = 1.0, 3600.0


def add_parser(subparsers: "argparse._SubParsersAction[argparse.ArgumentParser]") -> None:
    """Add the command and its options."""
    parser = subparsers.add_parser("doctor", help="look for what would keep a robot from running well; moves nothing")
    parser.add_argument("--config", required=True, type=Path, metavar="FILE", help="the robot's configuration (TOML)")
    parser.add_argument("--key", required=True, type=Path, metavar="FILE", help="the key file")
    parser.add_argument("--json", action="store_true", help="print the findings as JSON, see docs/doctor.md")
    parser.add_argument(
        "--seconds", type=_seconds, default=10.0, metavar="SECONDS", help="how long the loop is watched (%(default)g)"
    )
    parser.set_defaults(handler=_doctor)


def _doctor(args: argparse.Namespace) -> int:
    import json

    from mtm_onboard.doctor.examination import examine
    from mtm_onboard.doctor.finding import as_lines, as_table, worst

    findings = examine(args.config, args.key, args.seconds)
    print(json.dumps(as_table(findings), indent=2) if args.json else "\n".join(as_lines(findings)))
    return 1 if worst(findings) == "fail" else 0


def _seconds(text: str) -> float:
    value = float(text)
    if not _SHORTEST_S <= value <= _LONGEST_S:
        raise argparse.ArgumentTypeError(f"give {_SHORTEST_S:g} to {_LONGEST_S:g} seconds")
    return value
