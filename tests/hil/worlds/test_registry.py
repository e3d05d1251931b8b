import sys

import pytest

from hil.worlds.registry import NAMES, make_world
from hil.worlds.schemes import SIGNALS
from mtm_onboard.protocol import MtmError


def test_every_world_has_its_signal():
    assert set(NAMES) == set(SIGNALS)


@pytest.mark.parametrize("name", ["lunar-lander", "reacher", "discovery", "football"])
def test_a_world_s_axes_are_those_of_its_channels(name):
    if name in ("discovery", "football"):
        pytest.importorskip("vmas")
    world = make_world(name)
    assert world.axes == tuple(f"{body}.{axis}" for _, body, axes in SIGNALS[name].channels for axis in axes)
    assert (world.name, world.rate_hz) == (name, SIGNALS[name].rate_hz)


def test_a_world_that_does_not_exist_is_refused_with_those_that_do():
    with pytest.raises(MtmError, match="no world 'moon'; choose one of: discovery, lunar-lander, reacher, football"):
        make_world("moon")


def test_a_world_without_its_simulator_says_what_to_install(monkeypatch):
    monkeypatch.setitem(sys.modules, "mujoco", None)
    monkeypatch.delitem(sys.modules, "hil.worlds.reacher", raising=False)
    with pytest.raises(MtmError, match=r"reacher needs mujoco, .* install it with: pip install 'mtm\[worlds\]'"):
        make_world("reacher")
