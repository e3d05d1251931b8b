"""The page in a real browser: it is drawn, nothing is complained of, and nothing is asked of any other machine.

Chromium is some 300 MB with what it needs, too much for a machine that only tests; where it is, this runs.
"""

import json
import shutil
import subprocess

import cv2
import numpy as np
import pytest

from hil.sensors.camera import film
from hil.sensors.scene import Scene
from hil.sensors.video import write_video
from mtm_audit.cli import main
from mtm_audit.commands.decode import EXIT_CODES
from mtm_onboard.protocol import save_key
from tests.audit.filmed_robots import CAMERA, KEY, SECONDS, film_robots, trajectories
from tests.audit.moving_robot import OTHER_SECRET, key_of
from tests.patience import PATIENCE_S

CHROMIUM = next(filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))), None)
SIZE_PX = (1000, 3200)
COLOURS_BGR = {"decoded": (55, 127, 26), "absent": (24, 35, 180), "inconclusive": (8, 71, 181)}
# A port of this machine at which nobody listens.
NOBODY = "http://127.0.0.1:9/picture.png"

pytestmark = pytest.mark.skipif(CHROMIUM is None, reason="needs Chromium: apt install chromium")


@pytest.fixture(scope="module")
def reports(tmp_path_factory):
    """Reports of a film under its key and under another one, and of a film that shows one robot alone."""
    folder = tmp_path_factory.mktemp("reports")
    save_key(KEY, folder / "robot.key")
    save_key(key_of(KEY.scheme, OTHER_SECRET), folder / "other.key")
    film_robots(folder / "both.mp4")
    frames = film(CAMERA, Scene(), trajectories()[:1], np.random.default_rng(1))
    write_video(frames, folder / "one.mp4", CAMERA.rate_hz, 8)
    for verdict, name, key in (
        ("decoded", "both", "robot"),
        ("absent", "both", "other"),
        ("inconclusive", "one", "robot"),
    ):
        with pytest.raises(SystemExit) as left:
            main(["decode", str(folder / f"{name}.mp4"), "--key", str(folder / f"{key}.key"),
                  "--report", str(folder / f"{verdict}.html")])  # fmt: skip
        assert (left.value.code or 0) == EXIT_CODES[verdict]
    return folder


@pytest.mark.parametrize("verdict", COLOURS_BGR)
def test_a_page_is_drawn_without_complaint_or_request(reports, tmp_path, verdict):
    picture, complaints, asked = drawn(reports / f"{verdict}.html", tmp_path)
    assert (complaints, asked) == ([], [])
    assert picture.shape == (*SIZE_PX[::-1], 3)
    # The verdict in its colour, and a picture of the film, which is grey and large.
    assert np.sum(np.abs(picture[:120].astype(int) - COLOURS_BGR[verdict]).sum(axis=2) < 30) > 500
    assert np.mean(np.abs(picture.astype(int) - 255).sum(axis=2) > 60) > 0.1


def test_a_request_and_a_complaint_would_be_noticed(tmp_path):
    page = tmp_path / "page.html"
    page.write_text(f"<!DOCTYPE html><img src='{NOBODY}'><script>console.error('a complaint')</script>")
    _, complaints, asked = drawn(page, tmp_path)
    assert asked == [NOBODY]
    assert "a complaint" in complaints[0]


def test_a_page_of_a_minute_of_film_is_small(reports):
    size = (reports / "decoded.html").stat().st_size
    # Tracks grow with the film, and the picture and the rest do not.
    assert size * 60.0 / SECONDS < 3_000_000


def drawn(page, folder):
    """The page as the browser draws it, what it complained of, and the addresses that were asked for."""
    assert CHROMIUM is not None
    picture, log = folder / "page.png", folder / "net.json"
    done = subprocess.run(
        [CHROMIUM, "--headless", "--no-sandbox", "--disable-gpu", "--no-first-run", "--disable-background-networking",
         "--disable-component-update", "--disable-sync", "--hide-scrollbars", f"--user-data-dir={folder / 'profile'}",
         "--host-resolver-rules=MAP * ~NOTFOUND, EXCLUDE 127.0.0.1", f"--log-net-log={log}", "--enable-logging=stderr",
         f"--window-size={SIZE_PX[0]},{SIZE_PX[1]}",
         f"--screenshot={picture}", page.as_uri()],
        capture_output=True, text=True, timeout=2.0 * PATIENCE_S, check=True,
    )  # fmt: skip
    complaints = [line for line in done.stderr.splitlines() if "CONSOLE" in line]
    requests = [event["params"] for event in json.loads(log.read_text(encoding="utf-8"))["events"] if "params" in event]
    # The browser asks for news of its own, which no name server answers here; what a page asks for is marked as such.
    asked = {request["url"] for request in requests if str(request.get("network_isolation_key")).startswith("file:")}
    return cv2.imread(str(picture)), complaints, sorted(url for url in asked if not url.startswith(("file:", "data:")))
