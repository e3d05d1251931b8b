from dataclasses import replace
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from mtm_onboard.links.factory import make_link
from mtm_onboard.links.none import NullLink
from mtm_onboard.model.velocity import STOP
from mtm_onboard.protocol import MtmError
from mtm_onboard.protocol.input_file import BrokenTextError
from mtm_onboard.runtime.config import (
    ControlSettings,
    JournalSettings,
    LinkSettings,
    Robot,
    SourceSettings,
    config_from_table,
    load_config,
)
from mtm_onboard.runtime.guard import Limits, Staleness

EXAMPLES = Path(__file__).parents[3] / "examples/robots"
EXAMPLE = EXAMPLES / "none.toml"


def table(**sections):
    plain = {
        "robot": {"name": "r", "channel": "a"},
        "transport": {"kind": "none"},
        "limits": {"speed_mps": 1, "turn_rate_radps": 2.0},
        "source": {"kind": "udp", "port": 5005},
    }
    merged = plain | sections
    return {name: section for name, section in merged.items() if section is not None}


def test_base_commands_come_over_a_unix_socket_by_default():
    source = config_from_table(table(source={"socket": "r.base"})).source
    assert source == SourceSettings("unix", "r.base")
    assert str(source) == "the socket r.base"


def test_the_documented_example_says_what_it_says():
    config = load_config(EXAMPLE)
    assert config.robot == Robot("robot0", "robot0")
    assert (config.transport_kind, config.transport_options) == ("none", {})
    assert config.limits == Limits(1.0, 2.0, noise_sigmas=4.0)
    assert config.staleness == Staleness(0.1, 0.25)
    assert config.source == SourceSettings("unix", "robot0.base")
    assert config.journal == JournalSettings("robot0.csv", max_mb=200)
    assert config.link == LinkSettings(reconnect=True, give_up_s=60)
    assert config.control == ControlSettings("robot0.sock")


@pytest.mark.parametrize("path", sorted(EXAMPLES.iterdir()), ids=lambda path: path.stem)
def test_there_is_an_example_of_each_link_which_makes_that_link(path):
    config = load_config(path)
    assert config.transport_kind == path.stem
    assert make_link(config.transport_kind, config.transport_options).health is not None
    # Else they are as the one that explains them.
    assert replace(config, transport_kind="none", transport_options={}) == load_config(EXAMPLE)


def test_every_kind_of_link_has_an_example():
    with pytest.raises(MtmError) as refused:
        make_link("no such kind", {})
    kinds = str(refused.value).partition("choose one of: ")[2].split(", ")
    assert kinds
    assert {path.stem for path in EXAMPLES.iterdir()} == set(kinds)


def test_the_defaults_are_those_that_the_example_documents():
    config = config_from_table(table())
    assert config.staleness == load_config(EXAMPLE).staleness
    assert config.limits.noise_sigmas == load_config(EXAMPLE).limits.noise_sigmas
    assert config.link == load_config(EXAMPLE).link
    assert config.journal is None
    assert config.control is None


@pytest.mark.parametrize(
    ("sections", "sentence"),
    [
        ({"wheels": {}}, "unknown section or field 'wheels'"),
        ({"robot": "r"}, r"write \[robot\]"),
        ({"limits": None}, r"\[limits\] is missing"),
        ({"robot": {"name": "r"}}, "lacks channel"),
        ({"robot": {"name": 7, "channel": "a"}}, "name is 7; give text in quotes"),
        ({"robot": {"name": "r", "channel": "a", "colour": "red"}}, "unknown field 'colour'"),
        ({"transport": {}}, "needs a kind"),
        ({"transport": {"kind": "none", "options": [1]}}, "give text, a number, true or false"),
        ({"limits": {"speed_mps": "fast", "turn_rate_radps": 1.0}}, "speed_mps is 'fast'; give a number"),
        ({"limits": {"speed_mps": True, "turn_rate_radps": 1.0}}, "speed_mps is True; give a number"),
        ({"limits": {"speed_mps": -1.0, "turn_rate_radps": 1.0}}, "above zero"),
        ({"limits": {"speed_mps": float("nan"), "turn_rate_radps": 1.0}}, "above zero"),
        ({"stale": {"noise_off_s": 0.3}}, "noise off before the stop"),
        ({"source": {"kind": "radio"}}, "choose one of: unix, udp, stdin"),
        ({"source": {"kind": "udp"}}, "port belongs to kind udp"),
        ({"source": {"kind": "stdin", "port": 5005}}, "port belongs to kind udp"),
        ({"source": {"port": 5005}}, "socket belongs to kind unix"),
        ({"source": {}}, "socket belongs to kind unix"),
        ({"source": {"socket": ""}}, "socket belongs to kind unix"),
        ({"source": {"kind": "udp", "port": 5005, "socket": "r.base"}}, "socket belongs to kind unix"),
        ({"source": {"kind": "udp", "port": 70_000}}, "choose 1 to 65535"),
        ({"source": {"kind": "udp", "port": 5005.0}}, "give a whole number"),
        ({"journal": {}}, "lacks path"),
        ({"journal": {"path": "a.csv", "max_mb": 0.5}}, "give a number from 1 on"),
        ({"link": {"reconnect": "yes"}}, "reconnect is 'yes'; give true or false"),
        ({"link": {"give_up_s": 0}}, "give seconds above zero"),
    ],
)
def test_what_cannot_be_meant_is_refused_with_what_to_change(sections, sentence):
    with pytest.raises(MtmError, match=sentence):
        config_from_table(table(**sections))


values = st.recursive(
    st.text(max_size=5) | st.integers() | st.floats() | st.booleans(),
    lambda inner: st.lists(inner, max_size=2) | st.dictionaries(st.text(max_size=5), inner, max_size=3),
    max_leaves=4,
)
names = st.sampled_from(["robot", "transport", "link", "limits", "stale", "source", "journal", "kind", "port", "x"])


@given(names, names, values)
def test_any_change_gives_a_configuration_or_a_sentence(section, field, value):
    changed = table()
    changed[section] = value if section == field else {**changed.get(section, {}), field: value}
    try:
        config = config_from_table(changed)
    except MtmError:
        return
    assert config.limits.speed_mps > 0
    assert config.staleness.noise_off_s < config.staleness.stopped_s
    assert config.source.port is None or 1 <= config.source.port <= 65_535


def test_a_control_socket_is_optional_and_has_a_path():
    assert config_from_table(table()).control is None
    assert config_from_table(table(control={"socket": "a.sock"})).control == ControlSettings("a.sock")
    for section, sentence in (({}, "lacks socket"), ({"socket": 7}, "give text in quotes"), ({"port": 1}, "unknown")):
        with pytest.raises(MtmError, match=sentence):
            config_from_table(table(control=section))


def test_files_that_hold_no_configuration_are_refused(tmp_path):
    path = tmp_path / "robot.toml"
    with pytest.raises(MtmError, match="check the name"):
        load_config(path)
    path.write_bytes(b"\xff\xfe\x00")
    with pytest.raises(MtmError, match="not text"):
        load_config(path)
    path.write_text("speed = ")
    with pytest.raises(MtmError, match="correct that line") as caught:
        load_config(path)
    assert isinstance(caught.value.__cause__, BrokenTextError)
    path.write_text("[robot]\nname = 'r'\n")
    with pytest.raises(MtmError, match=r"robot.toml: the section \[transport\] is missing"):
        load_config(path)


def test_the_factory_makes_what_the_configuration_names():
    assert isinstance(make_link("none", {}), NullLink)
    with pytest.raises(MtmError, match="choose one of: none, robomaster-can"):
        make_link("tachyon", {})
    with pytest.raises(MtmError, match=r"correct \[transport\]"):
        make_link("none", {"bitrate": 1_000_000})


def test_a_dry_run_s_link_counts_and_refuses_what_is_not_finite():
    link = NullLink()
    with link:
        link.send(STOP)
        with pytest.raises(ValueError, match="finite"):
            link.send(STOP._replace(vx_mps=float("nan")))
    assert (link.sent, link.stops) == (1, 1)
