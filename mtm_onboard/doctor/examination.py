"""All checks of one robot, in the order in which their findings are best put right."""

from datetime import UTC, datetime
from pathlib import Path

from mtm_onboard.doctor.finding import Finding
from mtm_onboard.doctor.fit import check_fit
from mtm_onboard.doctor.host import check_clock, check_loop, check_processors
from mtm_onboard.doctor.link import check_link
from mtm_onboard.doctor.places import check_control, check_journal, check_key_file, check_source
from mtm_onboard.doctor.rights import check_grant, check_state
from mtm_onboard.model.wall_clock import is_synchronised
from mtm_onboard.protocol import MtmError, load_key
from mtm_onboard.runtime.config import load_config


def examine(config_path: Path, key_path: Path, loop_s: float) -> list[Finding]:
    """The findings of all checks; the loop is measured for `loop_s`.

    Without a configuration and a key the checks that need both are left out. No command is sent and no link opened.
    """
    config = key = None
    findings = []
    try:
        config = load_config(config_path)
        findings.append(Finding("configuration", "pass", f"{config_path} is {config.robot.name}'s"))
    except MtmError as error:
        findings.append(Finding("configuration", "fail", str(error)))
    try:
        key = load_key(key_path)
        findings += [check_key_file(key_path), check_grant(key, datetime.now(UTC))]
    except MtmError as error:
        findings.append(Finding("key", "fail", str(error)))
    if config is None or key is None:
        return findings
    return [
        *findings,
        check_fit(config, key),
        check_link(config.transport_kind, config.transport_options),
        check_source(config.source),
        check_control(config.control),
        check_journal(config.journal),
        check_state(config.ledger_path, key),
        check_clock(key.scheme.schedule, is_synchronised()),
        check_processors(),
        *check_loop(config.realtime, key.scheme, loop_s),
    ]
