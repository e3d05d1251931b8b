"""The node's parameters, with the names and units of the configuration's fields."""

from pathlib import Path
from typing import Any

from mtm_onboard.control.session import Plan
from mtm_onboard.protocol.errors import MtmError
from mtm_onboard.runtime.config import RobotConfig, config_from_table

# ROS has no parameter without a value: an empty text and a message below zero stand for none. The limits must be given.
DEFAULTS: dict[str, str | int | float] = {
    "key": "",
    "channel": "",
    "message": -1,
    "text": "",
    "speed_mps": 0.0,
    "turn_rate_radps": 0.0,
    "noise_off_s": 0.1,
    "stopped_s": 0.25,
    "journal": "",
    "state": "",
    "socket": "",
    "allow_unsynchronised": False,
}


def key_path(values: dict[str, Any]) -> Path:
    """The key file; raises MtmError when none is named."""
    key = values["key"]
    if not isinstance(key, str) or not key:
        raise MtmError("the parameter key names no file; give the key file of this robot, -p key:=/etc/mtm/robot0.key")
    return Path(key)


def config_of(values: dict[str, Any], name: str) -> RobotConfig:
    """The configuration of the robot `name`; raises MtmError for a value that no configuration may have."""
    table: dict[str, Any] = {
        "robot": {"name": name, "channel": values["channel"]},
        # Never used: the topics take their places.
        "transport": {"kind": "none"},
        "source": {"kind": "stdin"},
        "limits": {field: values[field] for field in ("speed_mps", "turn_rate_radps")},
        "stale": {field: values[field] for field in ("noise_off_s", "stopped_s")},
    }
    for section, field in (("journal", "path"), ("state", "path"), ("control", "socket")):
        value = values["socket" if section == "control" else section]
        if value != "":
            table[section] = {field: value}
    try:
        return config_from_table(table)
    except MtmError as error:
        raise MtmError(f"a parameter is wrong: {error}") from error


def plan_of(values: dict[str, Any]) -> Plan:
    """What to send, again and again from the start on; raises MtmError for a message that is none, or two of them."""
    number, text = values["message"], values["text"]
    if type(number) is not int or not isinstance(text, str):
        raise MtmError("the message must be a whole number and the text a text in quotes; correct the parameter")
    if type(values["allow_unsynchronised"]) is not bool:
        raise MtmError("allow_unsynchronised must be true or false; correct the parameter")
    if number >= 0 and text:
        raise MtmError("both a message and a text are given; give one of the two")
    content = text or (number if number >= 0 else None)
    return Plan(content, allow_unsynchronised=values["allow_unsynchronised"])
