"""A holonomic robot that sends on x, y and yaw at once, each with its own sigma: from key generation to the verdict."""

from dataclasses import replace

import pytest

from hil.fleet.lockstep import run_lockstep
from hil.fleet.recording import motion_capture_tracks
from hil.fleet.rig import RunSettings
from hil.sensors.motion_capture import MotionCapture
from mtm_audit.decoding.decode import decode_tracks
from mtm_audit.decoding.settings import DecodeSettings
from mtm_onboard.cli import main
from mtm_onboard.protocol import load_key

START_S = 1.5


@pytest.fixture
def three_axes(tmp_path):
    """A key for two robots, whose yaw has twice the sigma of their velocities."""
    channels = [part for name in ("robot0", "robot1") for part in ("--channel", f"{name}:vx,vy,wz:3:0.1,0.1,0.2")]
    scheme = ["--name", "yaw", "--rate", "50", "--band", "0.5:5", "--alphabet", "64", "--message-ticks", "300"]
    path = tmp_path / "yaw.key"
    assert main(["keygen", "--id", "yaw", "--out", str(path), "--schedule", "fixed", *scheme, *channels]) == 0
    return load_key(path)


@pytest.mark.parametrize("wire", ["direct", "can"])
def test_a_message_on_three_axes_is_decoded(three_axes, wire):
    symbols = (9, 60, 33, 2, 47, 18)
    settings = RunSettings(key=three_axes, symbols=symbols, seconds=20.0, seed=4, wire=wire, start_s=START_S)
    tracks = motion_capture_tracks(run_lockstep(settings), settings.seed, MotionCapture())
    found = decode_tracks(tracks, three_axes, DecodeSettings(onset_s=START_S))
    assert found.symbols == symbols
    assert found.verdict == "decoded"
    planar = decode_tracks(
        [replace(track, headings_rad=None) for track in tracks], three_axes, DecodeSettings(onset_s=START_S)
    )
    assert found.evidence.nats > planar.evidence.nats + 20.0
