import av
import cv2
import numpy as np
import pytest
from av.video.reformatter import ColorRange, Colorspace

from mtm_audit.model.picture import Frame
from mtm_audit.readers.video import read_frames
from mtm_audit.tracking.registry import tracker
from mtm_onboard.protocol import MtmError
from tests.audit.readers.video.films import HEIGHT, WIDTH, Encoding, pictures, turn, write_film

MATRICES = {"709": (Colorspace.ITU709, 1), "601": (Colorspace.ITU601, 6), "2020": (Colorspace.BT2020, 9)}


def first_picture(path, pixels="bgr"):
    return next(read_frames(path, pixels)).image


def coloured_film(path, bgr, matrix, *, full=False, tagged=True):
    """A film of one colour under a matrix and a range, which the stream states unless told otherwise."""
    space, number = MATRICES[matrix]
    target = ColorRange.JPEG if full else ColorRange.MPEG
    with av.open(str(path), "w") as container:
        stream = container.add_stream("libx264", rate=30, options={"crf": "4"})
        stream.width, stream.height, stream.pix_fmt = WIDTH, HEIGHT, "yuv420p"
        if tagged:
            stream.codec_context.colorspace = number
            stream.codec_context.color_range = target.value
        for _ in range(5):
            picture = av.VideoFrame.from_ndarray(np.full((HEIGHT, WIDTH, 3), bgr, np.uint8), format="bgr24")
            picture = picture.reformat(
                format="yuv420p", dst_colorspace=space, src_color_range=ColorRange.JPEG, dst_color_range=target
            )
            container.mux(stream.encode(picture))
        container.mux(stream.encode(None))
    return path


@pytest.mark.parametrize("full", [False, True])
@pytest.mark.parametrize("matrix", MATRICES)
@pytest.mark.parametrize("bgr", [(30, 40, 200), (40, 180, 60), (200, 90, 20)])
def test_colours_follow_the_matrix_and_range_of_the_file(tmp_path, bgr, matrix, full):
    image = first_picture(coloured_film(tmp_path / "film.mp4", bgr, matrix, full=full))
    assert np.median(image, axis=(0, 1)) == pytest.approx(bgr, abs=4)


def test_without_a_tag_colours_are_those_of_bt601(tmp_path):
    image = first_picture(coloured_film(tmp_path / "film.mp4", (30, 40, 200), "601", tagged=False))
    assert np.median(image, axis=(0, 1)) == pytest.approx((30, 40, 200), abs=4)


def test_hues_of_a_tagged_film_are_right_to_a_degree(tmp_path):
    for bgr in ((30, 40, 200), (220, 60, 50), (40, 200, 190)):
        image = first_picture(coloured_film(tmp_path / "film.mp4", bgr, "709"))
        wanted = cv2.cvtColor(np.array([[bgr]], np.float32) / 255, cv2.COLOR_BGR2HSV)[0, 0, 0]
        got = cv2.cvtColor(image[:1, :1].astype(np.float32) / 255, cv2.COLOR_BGR2HSV)[0, 0, 0]
        assert got == pytest.approx(wanted, abs=1.5)


def test_a_red_of_a_bt709_film_is_followed(tmp_path):
    path = tmp_path / "film.mp4"
    with av.open(str(path), "w") as container:
        stream = container.add_stream("libx264", rate=30)
        stream.width, stream.height, stream.pix_fmt = WIDTH, HEIGHT, "yuv420p"
        stream.codec_context.colorspace, stream.codec_context.color_range = 1, 1
        for number in range(30):
            image = np.full((HEIGHT, WIDTH, 3), 120, np.uint8)
            cv2.circle(image, (40 + number, 48), 14, (0, 0, 255), -1)
            picture = av.VideoFrame.from_ndarray(image, format="bgr24").reformat(
                format="yuv420p", dst_colorspace=Colorspace.ITU709, dst_color_range=ColorRange.MPEG
            )
            container.mux(stream.encode(picture))
        container.mux(stream.encode(None))
    (track,) = tracker("colour:#ff0000").track(read_frames(path, "bgr"))
    assert track.valid.sum() == 30


def corner_marked():
    """A still picture with a white patch in the upper left corner, wider than high."""
    image = np.full((HEIGHT, WIDTH, 3), 40, np.uint8)
    image[:16, :48] = 230
    return image


@pytest.mark.parametrize("pixels", ["gray", "bgr"])
@pytest.mark.parametrize(("left_right", "upper_lower"), [(False, False), (True, False), (False, True)])
@pytest.mark.parametrize("degrees", [0, 90, 180, 270])
def test_the_picture_is_turned_as_players_show_it(tmp_path, degrees, left_right, upper_lower, pixels):
    film = write_film(tmp_path / "film.mp4", [corner_marked()] * 5)
    turn(film, degrees, left_right=left_right, upper_lower=upper_lower)
    shown = np.rot90(corner_marked(), degrees // 90)
    shown = shown[:, ::-1] if left_right else shown
    shown = shown[::-1] if upper_lower else shown
    image = first_picture(film, pixels)
    assert image.shape[:2] == shown.shape[:2]
    assert np.array_equal((image.reshape(*shown.shape[:2], -1)[..., 0] > 128), shown[..., 0] > 128)


def test_an_odd_turn_is_said_and_not_made(tmp_path):
    film = turn(write_film(tmp_path / "film.mp4", [corner_marked()] * 5), 30)
    warnings = []
    assert next(read_frames(film, warn=warnings.append)).size == (WIDTH, HEIGHT)
    assert "odd angle" in warnings[0]


@pytest.mark.parametrize("suffix", ["mkv", "mp4"])
def test_a_cover_in_front_of_the_film_is_passed_over(tmp_path, suffix):
    path = tmp_path / f"film.{suffix}"
    with av.open(str(path), "w") as container:
        cover = container.add_stream("mjpeg", rate=1)
        cover.width, cover.height, cover.pix_fmt = 64, 64, "yuvj420p"
        cover.disposition = av.stream.Disposition.attached_pic
        film = container.add_stream("libx264", rate=30)
        film.width, film.height, film.pix_fmt = WIDTH, HEIGHT, "yuv420p"
        container.mux(cover.encode(av.VideoFrame.from_ndarray(np.zeros((64, 64, 3), np.uint8), format="bgr24")))
        container.mux(cover.encode(None))
        for image in pictures(20):
            container.mux(film.encode(av.VideoFrame.from_ndarray(image, format="bgr24")))
        container.mux(film.encode(None))
    frames = list(read_frames(path))
    assert len(frames) == 20
    assert frames[0].size == (WIDTH, HEIGHT)


def test_a_song_with_a_cover_is_no_film(tmp_path):
    path = tmp_path / "song.mp4"
    with av.open(str(path), "w") as container:
        cover = container.add_stream("mjpeg", rate=1)
        cover.width, cover.height, cover.pix_fmt = 64, 64, "yuvj420p"
        cover.disposition = av.stream.Disposition.attached_pic
        container.mux(cover.encode(av.VideoFrame.from_ndarray(np.zeros((64, 64, 3), np.uint8), format="bgr24")))
        container.mux(cover.encode(None))
    with pytest.raises(MtmError, match="cover picture and no film"):
        list(read_frames(path))


@pytest.mark.parametrize(
    ("codec", "pixel_format"),
    [
        ("libx265", "yuv420p10le"),
        ("libx265", "yuv422p12le"),
        ("prores_ks", "yuv422p10le"),
        ("ffv1", "bgr0"),
        ("ffv1", "gray16le"),
    ],
)
def test_gray_of_every_format_shows_the_same_picture(tmp_path, codec, pixel_format):
    quiet = {"x265-params": "log-level=none:crf=8"} if codec == "libx265" else {}
    film = write_film(
        tmp_path / "film.mkv", pictures(5), Encoding(codec=codec, pixel_format=pixel_format, options=quiet)
    )
    wanted = cv2.cvtColor(pictures(1)[0], cv2.COLOR_BGR2GRAY).astype(float)
    got = first_picture(film, "gray").astype(float)
    assert np.corrcoef(wanted.ravel(), got.ravel())[0, 1] > 0.99


def test_frames_keep_their_pictures_while_others_are_read(tmp_path):
    film = write_film(tmp_path / "film.mp4", pictures(60))
    kept: list[Frame] = list(read_frames(film))
    again = [frame.image.copy() for frame in read_frames(film)]
    assert all(np.array_equal(frame.image, copy) for frame, copy in zip(kept, again, strict=True))
