"""`mtm-onboard export` through the shipped command line."""

import pytest

from mtm_onboard.cli import main
from mtm_onboard.image import parse_image, tag_is_good
from mtm_onboard.protocol import Channel, Key, Scheme, load_key, save_key

SECRET = b"not a real secret, only for test"


@pytest.fixture
def key_path(tmp_path, request):
    schedule, robots = getattr(request, "param", ("rolling", 2))
    channels = tuple(Channel(f"robot{n}", f"robot{n}", ("vx", "vy"), 2, 0.1) for n in range(robots))
    scheme = Scheme("test", 50.0, (0.5, 5.0), 4, 100, channels, schedule=schedule)
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


@pytest.mark.parametrize("key_path", [("fixed", 1)], indirect=True)
def test_one_channel_needs_no_name_and_a_fixed_message_repeats_unless_told_not_to(key_path):
    assert parse_image(export(key_path, "--message", "5")[1].read_bytes()).repeats
    assert not parse_image(export(key_path, "--message", "5", "--no-repeat")[1].read_bytes()).repeats


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (["--symbols", "0,1,2,3"], "--channel"),
        (["--symbols", "0,1,2", "--channel", "robot0"], "3 symbols given"),
        (["--message", "100000", "--channel", "robot0"], "does not fit"),
        (["--message", "1", "--channel", "nobody"], "no channel"),
        (["--message", "1", "--channel", "robot0", "--span", "-1"], "span"),
        (["--message", "1", "--channel", "robot0", "--span", "inf"], "span"),
        (["--message", "1", "--channel", "robot0", "--span", "1e9"], "several images"),
        (["--message", "1", "--channel", "robot0", "--limit-mps", "0"], "limit"),
    ],
)
def test_bad_input_is_one_sentence_and_leaves_an_older_image_alone(key_path, options, words, capsys):
    (key_path.parent / "image.bin").write_bytes(b"older")
    code, out = export(key_path, *options)
    error = capsys.readouterr().err
    assert code == 1
    assert words in error
    assert error.count("\n") == 1
    assert out.read_bytes() == b"older"
