import re
import sys

import pytest

from hil.cli import main
from hil.worlds.registry import NAMES, make_world
from hil.worlds.schemes import SIGNALS
from mtm_onboard.protocol import MtmError


def test_every_world_has_its_signal():
    assert set(NAMES) == set(SIGNALS)


@pytest.mark.parametrize(
    "name",
    ["lunar-lander", "reacher", *(pytest.param(name, marks=pytest.mark.long) for name in ("discovery", "football"))],
)
def test_a_world_s_axes_are_those_of_its_channels(name):
    if name in ("discovery", "football"):
        pytest.importorskip("vmas")
    world = make_world(name)
    assert world.axes == tuple(f"{body}.{axis}" for _, body, axes in SIGNALS[name].channels for axis in axes)
    assert (world.name, world.rate_hz) == (name, SIGNALS[name].rate_hz)


def test_a_world_that_does_not_exist_is_refused():
    with pytest.raises(MtmError, match="no world 'moon'; choose one of: discovery, lunar-lander, reacher, football"):
        make_world("moon")


@pytest.mark.parametrize(
    ("world", "package"),
    [("reacher", "mujoco"), ("lunar-lander", "Box2D"), ("discovery", "vmas"), ("football", "vmas")],
)
@pytest.mark.parametrize("command", [["paper"], ["film"], ["sweep"]], ids=lambda command: command[0])
def test_a_world_without_its_simulator_says_what_to_install(monkeypatch, capsys, tmp_path, world, package, command):
    monkeypatch.setitem(sys.modules, package, None)
    out = ["--out", str(tmp_path / "out")]
    options = {"paper": ["--quick", "--cells", str(tmp_path / "cells")], "film": ["--no-message", *out], "sweep": out}
    with pytest.raises(SystemExit) as leaving:
        main([*command, world, *options[command[0]]])
    assert leaving.value.code == 1
    (sentence,) = capsys.readouterr().err.splitlines()
    assert re.search(
        rf"world {world} needs .*{package}.* is missing; install it with: pip install 'messages-.*\[worlds\]'",
        sentence,
    )
    assert not (tmp_path / "out").exists()
