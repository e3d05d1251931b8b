"""`mtm-audit plan`: the fastest schemes for a payload, from an accuracy table."""

from dataclasses import dataclass
from pathlib import Path

from mtm_audit.commands.console import answer_console
from mtm_audit.detectors.matched.profile import load_profile
from mtm_audit.planning.check import check_all
from mtm_audit.planning.plan import Plan, Problem
from mtm_audit.planning.provision import scheme_of_plan
from mtm_audit.planning.report import check_lines, corrections, fastest, headline, remarks, rich_table
from mtm_audit.planning.search import Found, search
from mtm_audit.planning.shaping import shaped, shaping_for, shaping_text
from mtm_audit.planning.table import read_table
from mtm_audit.reporting.plot import check_plot_path
from mtm_onboard.protocol.errors import MtmError
from mtm_onboard.protocol.key import load_key
from mtm_onboard.protocol.output_file import check_outputs
from mtm_onboard.protocol.scheme import Scheme
from mtm_onboard.protocol.schemefile import save_scheme

DISAGREES = 4
COMMAND = "mtm-audit plan"


@dataclass(frozen=True)
class PlanOptions:
    """What the command line asked for. `rate_hz` or `like` is given; `strategy` None writes the fastest one."""

    table: Path
    problem: Problem
    rate_hz: float | None
    like: Path | None
    strategy: str | None
    check: Path | None
    plot: Path | None
    out: Path | None
    force: bool = False
    profile: Path | None = None


def run_plan(options: PlanOptions) -> int:
    """Plan, report, write; returns 0, or 4 when held-out measurements disagree. Raises MtmError before writing."""
    check_outputs(COMMAND, options.out, options.plot, force=options.force)
    if options.plot is not None:
        check_plot_path(options.plot)
    table = read_table(options.table)
    held_out = None if options.check is None else read_table(options.check)
    like = None if options.like is None else load_key(options.like).scheme
    rate_hz = options.rate_hz or (like.rate_hz if like else 0.0)
    profile = None if options.profile is None else load_profile(options.profile)
    found = search(table, options.problem)
    scheme, shaping = _scheme(options, found, like), None
    if profile is not None and like is not None:
        shaping = shaping_for(scheme_of_plan(_chosen(options.strategy, found), like), profile)
        scheme = scheme and shaped(scheme, shaping)
    plans = [one.plan for one in found if one.plan]
    checks = [] if held_out is None else check_all(plans, held_out, at_least=shaping is not None)
    lines = [*remarks(table, options.problem, found), *corrections(table, options.problem, found, rate_hz)]
    if shaping is not None:
        lines.append(shaping_text(shaping))
    if held_out is not None:
        lines += check_lines(found, checks)
    if options.plot is not None:
        from mtm_audit.planning.draw import draw_plan

        draw_plan(table, options.problem, found, rate_hz, options.plot)
    if options.out is not None and scheme is not None:
        save_scheme(scheme, options.out, (f"{COMMAND}: {headline(found, options.problem, rate_hz)}",))
    print(headline(found, options.problem, rate_hz))
    # In a pipe nobody sees where a line ends, and a cut table cannot be read.
    console = answer_console()
    console.print(rich_table(found, options.problem, rate_hz), highlight=False)
    if scheme is not None:
        lines.append(f"wrote {options.out}: scheme {scheme.name} (fingerprint {scheme.fingerprint})")
    if options.plot is not None:
        lines.append(f"wrote {options.plot}")
    print("\n".join(lines))
    return 0 if all(one.agrees for one in checks) else DISAGREES


def _scheme(options: PlanOptions, found: tuple[Found, ...], like: Scheme | None) -> Scheme | None:
    if options.out is None:
        return None
    if like is None:
        raise MtmError("a scheme file needs band, axes and noise as well; give a key of these robots with --like")
    return scheme_of_plan(_chosen(options.strategy, found), like)


def _chosen(strategy: str | None, found: tuple[Found, ...]) -> Plan:
    if strategy is None:
        return fastest(found)
    plan = next((one.plan for one in found if one.strategy == strategy and one.meets_target), None)
    if plan is None:
        raise MtmError(f"no {strategy} scheme meets the target; leave out --strategy to write the fastest that does")
    return plan
