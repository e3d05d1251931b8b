import pytest

from hil.worlds.schemes import same_scheme, single_scheme, split_scheme
from mtm_onboard.protocol import MtmError


def test_axes_of_one_body_that_carry_the_same_are_one_channel():
    (channel,) = same_scheme("reacher", 8, 240, 1).channels
    assert (channel.body, channel.axes) == ("arm", ("inner", "outer"))


def test_a_team_carries_the_same_on_a_channel_each():
    scheme = same_scheme("football", 64, 516, 1)
    assert scheme.combine == "same"
    assert [channel.body for channel in scheme.channels] == ["agent0", "agent1", "agent2"]


def test_a_split_message_has_so_many_symbols_on_each_channel():
    scheme = split_scheme("lunar-lander", 4, 576, (2, 3))
    assert [scheme.window_ticks(channel) for channel in scheme.channels] == [288, 192]


def test_a_stochastic_policy_keeps_its_marginals():
    assert same_scheme("reacher", 8, 240, 1).power == "ensemble"
    assert same_scheme("lunar-lander", 8, 288, 1).power == "window"


def test_a_channel_that_the_world_lacks_is_refused():
    with pytest.raises(MtmError, match="discovery has no channel 'z'; choose one of: x, y"):
        single_scheme("discovery", "z", 8, 108, 1)
