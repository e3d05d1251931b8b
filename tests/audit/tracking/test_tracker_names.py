"""The trackers through the command line: what a person who names one gets to see."""

from fractions import Fraction

import av
import numpy as np
import pytest

from hil.sensors.video import write_video
from mtm_audit.cli import main
from mtm_audit.model.picture import Frame
from mtm_onboard.protocol import Channel, Scheme, save_key
from tests.audit.moving_robot import key_of
from tests.audit.tracking.test_arms import arm

TICKS, SYMBOL = 300, 2
SCHEME = Scheme(
    name="test",
    rate_hz=50.0,
    band_hz=(0.5, 5.0),
    alphabet_size=4,
    message_ticks=TICKS,
    channels=(Channel("inner", "arm", ("inner",), 1, 1.0),),
)
KEY = key_of(SCHEME)
TRACKERS = (
    "aruco", "colour:red", "colour:hsv(0-10,80-255,60-255)", "brightness:8,8,120,88", "centroid:red", "arms",
    "arms:red,blue", "football", "football:red,blue", "flow:20,20,60,60",
)  # fmt: skip


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    path = tmp_path_factory.mktemp("names")
    save_key(KEY, path / "arm.key")
    return path


@pytest.fixture
def audit(folder, capsys):
    """Run `mtm-audit decode` with the key of an arm; gives the exit code, standard output and standard error."""

    def run(*arguments):
        chosen = ["--key", str(folder / "arm.key"), "--detector", "coherency", "--onset", "0", "--decoys", "30"]
        with pytest.raises(SystemExit) as left:
            main(["decode", *map(str, arguments), *chosen])
        out, err = capsys.readouterr()
        assert "Traceback" not in out + err
        return left.value.code or 0, out, err

    return run


def refused(answer, words, code=1):
    """One sentence on standard error, nothing on standard output, and the exit code."""
    err = answer[2]
    assert answer[:2] == (code, "")
    assert err.startswith("mtm-audit: ")
    assert err.count("\n") == 1
    assert words in err


def swinging(symbol, hidden=()):
    """Pictures of an arm that swings, and whose inner joint turns with the noise of a symbol (None for without)."""
    times_s = np.arange(TICKS + 1) / 50
    angles = np.stack([0.5 + np.sin(times_s), 1.0 + 0.6 * np.sin(1.3 * times_s)], axis=1)
    if symbol is not None:
        noise = KEY.codebook(0).samples(SCHEME.channel("inner"), 0)[symbol]
        angles[1:, 0] += np.cumsum(np.ravel(noise)) / 50
    return arm(angles, hidden=hidden)


def test_a_message_in_an_arms_joint_is_decoded_from_the_video(audit, tmp_path):
    write_video(swinging(SYMBOL), tmp_path / "arm.mp4", 50)
    code, out, _ = audit(tmp_path / "arm.mp4", "--tracker", "arms")
    assert (code, out.splitlines()[0]) == (0, f"decoded: message {SYMBOL} (0b10)")


def test_a_silent_or_absent_arm_says_nothing_wrong(audit, tmp_path):
    write_video(swinging(None), tmp_path / "silent.mp4", 50)
    assert audit(tmp_path / "silent.mp4", "--tracker", "arms")[0] == 3
    write_video(swinging(SYMBOL, hidden=range(100, 160)), tmp_path / "away.mp4", 50)
    code, out, _ = audit(tmp_path / "away.mp4", "--tracker", "arms")
    assert code in (0, 3, 4)
    assert ("decoded" in out) == (code == 0) == (f"decoded: message {SYMBOL}" in out)


def test_an_arm_out_of_view_is_refused(audit, tmp_path):
    write_video(arm(np.zeros((20, 2)), hidden=range(20)), tmp_path / "arm.mp4", 50)
    refused(audit(tmp_path / "arm.mp4", "--tracker", "arms"), "the colour of the inner link, is not found in 20 frames")


@pytest.fixture
def gray_room(tmp_path):
    gray = np.full((96, 128, 3), 40, dtype=np.uint8)
    write_video([Frame(number / 30, gray) for number in range(12)], tmp_path / "gray.mp4")
    return tmp_path / "gray.mp4"


@pytest.mark.parametrize("name", TRACKERS)
def test_a_video_without_what_the_tracker_seeks_is_refused(audit, gray_room, name):
    refused(audit(gray_room, "--tracker", name), "")


@pytest.mark.parametrize("name", ["brightness:8,8,200,88", "flow:20,20,60,160"])
def test_a_region_beyond_the_picture_is_refused(audit, gray_room, name):
    refused(audit(gray_room, "--tracker", name), "reaches beyond the picture, which is 128 x 96 pixels")


@pytest.mark.parametrize(
    "name",
    [
        "brightness:1,2,3",
        "brightness:9,9,1,1",
        "flow",
        "flow:9,9,1,1",
        "arms:red",
        "football:mauve-ish",
        "colour:hsv(1-2)",
    ],
)
def test_a_bad_name_is_refused_before_the_video_is_read(audit, tmp_path, name):
    code, out, err = audit(tmp_path / "missing.mp4", "--tracker", name)
    assert (code, out) == (2, "")
    assert err.count("\n") == 1
    assert "No such file" not in err


def test_an_unknown_tracker_is_told_all_there_are(audit, gray_room):
    answer = audit(gray_room, "--tracker", "eyes")
    for kind in ("aruco", "colour:", "brightness", "arms", "football", "flow:"):
        refused(answer, kind, code=2)


def clip(path, width_px, height_px, first):
    """Part of a transport stream, which may be put behind another."""
    with av.open(str(path), "w", format="mpegts") as container:
        stream = container.add_stream("libx264", rate=30)
        stream.width, stream.height, stream.pix_fmt = width_px, height_px, "yuv420p"
        stream.options = {"preset": "ultrafast", "bf": "0"}
        for number in range(first, first + 8):
            image = np.full((height_px, width_px, 3), 40, np.uint8)
            image[30:60, 40:70] = np.kron(np.indices((6, 6)).sum(axis=0) % 2 * 180, np.ones((5, 5)))[..., None]
            picture = av.VideoFrame.from_ndarray(image, format="bgr24")
            picture.pts, picture.time_base = number, Fraction(1, 30)
            container.mux(stream.encode(picture))
        container.mux(stream.encode(None))
    return path.read_bytes()


@pytest.mark.parametrize("name", [*TRACKERS[:-1], "flow:36,26,74,64"])
def test_a_picture_that_changes_its_size_midway_is_refused(audit, tmp_path, name):
    film = tmp_path / "film.ts"
    film.write_bytes(clip(tmp_path / "a.ts", 128, 96, 0) + clip(tmp_path / "b.ts", 96, 128, 30))
    refused(audit(film, "--tracker", name), "the picture changes from 128 x 96 to 96 x 128 at 1.000 s")
