"""`mtm-onboard export` through the shipped command line."""

import time

import numpy as np
import pytest

from mtm_onboard.cli import main
from mtm_onboard.firmware.device_key import load_device_key
from mtm_onboard.firmware.image import ONE, parse_image, tag_is_good
from mtm_onboard.firmware.seal import parse_sealed
from mtm_onboard.protocol import Channel, Key, Scheme, load_key, save_key
from mtm_onboard.protocol.framing import Framing
from mtm_onboard.protocol.slots import slot_at
from mtm_onboard.runtime.message import message_of
from mtm_onboard.runtime.modulator import Modulator

SECRET = b"not a real secret, only for test"


@pytest.fixture
def key_path(tmp_path, request):
    schedule, robots = getattr(request, "param", ("rolling", 2))
    channels = tuple(Channel(f"robot{n}", f"robot{n}", ("vx", "vy"), 2, 0.1) for n in range(robots))
    scheme = Scheme(
        name="test",
        rate_hz=50.0,
        band_hz=(0.5, 5.0),
        alphabet_size=4,
        message_ticks=100,
        channels=channels,
        schedule=schedule,
    )
    save_key(Key("test", SECRET, scheme), tmp_path / "robot.key")
    return tmp_path / "robot.key"


def export(key_path, *options):
    out = key_path.parent / "image.bin"
    code = main(["export", "--key", str(key_path), "-o", str(out), *options])
    return code, out


def test_the_image_holds_the_channels_part_of_the_message(key_path, capsys):
    code, out = export(key_path, "--channel", "robot1", "--symbols", "0,1,2,3", "--span", "9.5", "--first-message", "3")
    image = parse_image(out.read_bytes())
    assert code == 0
    assert (image.messages, image.first_message, image.message_ticks) == (5, 3, 100)
    assert image.fingerprint == load_key(key_path).scheme.fingerprint
    assert tag_is_good(image, SECRET)
    assert out.stat().st_mode & 0o777 == 0o600
    assert "5 message(s) in 10 s" in capsys.readouterr().out


def test_an_image_is_sealed_for_its_device(key_path, capsys):
    device = key_path.parent / "device.key"
    assert main(["device-key", "--out", str(device)]) == 0
    assert main(["device-key", "--out", str(device)]) == 1
    assert "exists already" in capsys.readouterr().err
    options = ("--channel", "robot1", "--symbols", "0,1,2,3", "--device-key", str(device))
    code, out = export(key_path, *options, "--noise-limit", "2", "--counter", "9")
    seal, image = parse_sealed(out.read_bytes(), load_device_key(device))
    assert (code, seal.channel, seal.counter) == (0, 1, 9)
    assert seal.noise_limits_q20 == (round(0.2 * ONE), round(0.2 * ONE), 0)
    assert image.fingerprint == load_key(key_path).scheme.fingerprint
    # By itself the counter is the time, so that a later image is newer.
    seal, _ = parse_sealed(export(key_path, *options, "--device-channel", "7")[1].read_bytes(), load_device_key(device))
    assert seal.channel == 7
    assert abs(seal.counter - time.time()) < 600.0
    assert seal.noise_limits_q20[0] == round(0.4 * ONE)


def test_a_seal_without_a_device_key_is_usage(key_path, capsys):
    with pytest.raises(SystemExit) as left:
        export(key_path, "--channel", "robot1", "--symbols", "0,1,2,3", "--counter", "9")
    assert left.value.code == 2
    assert "a seal needs --device-key" in capsys.readouterr().err


@pytest.mark.parametrize(("text", "mode", "says"), [("no key", 0o600, "no device key"), ("0" * 64, 0o644, "by others")])
def test_a_bad_device_key_is_refused(key_path, capsys, text, mode, says):
    device = key_path.parent / "device.key"
    device.write_text(text)
    device.chmod(mode)
    code, out = export(key_path, "--channel", "robot1", "--symbols", "0,1,2,3", "--device-key", str(device))
    assert code == 1
    assert says in capsys.readouterr().err
    assert not out.exists()


def test_a_robot_s_file_of_format_2_exports_its_own_channel(tmp_path, capsys):
    main(["keygen", "--id", "f", "--preset", "robomaster-fleet", "--out", str(tmp_path / "m.key")])
    path = tmp_path / "robot.key"
    main(["issue", "--master", str(tmp_path / "m.key"), "--channel", "robot1", "--out", str(path)])
    slot = str(slot_at(time.time(), load_key(path).scheme))
    assert export(path, "--channel", "robot1", "--message", "5", "--first-message", slot)[0] == 0
    assert export(path, "--channel", "robot0", "--message", "5", "--first-message", slot)[0] == 1
    assert "for robot1 and not for robot0" in capsys.readouterr().err


@pytest.mark.parametrize("key_path", [("fixed", 1)], indirect=True)
def test_one_channel_needs_no_name_and_a_fixed_message_repeats(key_path):
    assert parse_image(export(key_path, "--message", "5")[1].read_bytes()).repeats
    assert not parse_image(export(key_path, "--message", "5", "--no-repeat")[1].read_bytes()).repeats


def test_a_framed_message_is_written_as_each_slot_and_day_has_it(tmp_path):
    framing = Framing("text", 16, check="tag", check_bits=16, interleave=True)
    channels = (Channel("robot0", "robot0", ("vx", "vy"), 20, 0.1),)
    key = Key(
        "test",
        SECRET,
        Scheme(
            name="test",
            rate_hz=50.0,
            band_hz=(2.0, 20.0),
            alphabet_size=4,
            message_ticks=400,
            channels=channels,
            schedule="rolling",
            framing=framing,
        ),
    )
    save_key(key, tmp_path / "robot.key")
    # The second of these three slots of 8 s begins at midnight.
    _, out = export(tmp_path / "robot.key", "--text", "hi", "--first-message", "10799", "--messages", "3")
    modulator = Modulator(key.codebook(10_799), "robot0", message_of("hi", key))
    noise = []
    for tick in range(1200):
        noise.append(0.1 * modulator.perturbation(tick))
        modulator.prepare(tick)
    image = parse_image(out.read_bytes())
    played = image.samples.T * np.array(image.steps[:2]) / (1 << 36)
    assert played == pytest.approx(np.array(noise), abs=1e-4)


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (["--symbols", "0,1,2,3"], "--channel"),
        (["--symbols", "0,1,2", "--channel", "robot0"], "3 symbols given"),
        (["--message", "100000", "--channel", "robot0"], "does not fit"),
        (["--message", "1", "--channel", "nobody"], "no channel"),
        (["--message", "1", "--channel", "robot0", "--span", "-1"], "the span"),
        (["--message", "1", "--channel", "robot0", "--span", "inf"], "the span"),
        (["--message", "1", "--channel", "robot0", "--span", "1e9"], "several images"),
        (["--message", "1", "--channel", "robot0", "--limit-mps", "0"], "limit"),
    ],
)
def test_bad_input_leaves_an_older_image_alone(key_path, options, words, capsys):
    (key_path.parent / "image.bin").write_bytes(b"MTMI older")
    code, out = export(key_path, *options)
    error = capsys.readouterr().err
    assert code == (2 if words == "the span" else 1)
    assert words in error
    assert error.count("\n") == 1
    assert out.read_bytes() == b"MTMI older"
