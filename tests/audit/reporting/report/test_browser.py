"""The page in a real browser: it is drawn, nothing is complained of, and nothing is asked of any other machine.

Chromium is some 300 MB with what it needs, too much for a machine that only tests; where it is, this runs.
"""

import json
import shutil
import subprocess

import cv2
import numpy as np
import pytest

from mtm_audit.cli import main
from mtm_onboard.protocol import save_key
from tests.audit.filmed_robots import KEY, film_robots
from tests.audit.moving_robot import OTHER_SECRET, key_of
from tests.patience import PATIENCE_S

CHROMIUM = next(filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))), None)
SIZE_PX = (1000, 3200)
# Hosts of the browser's own, which headless runs may ask for news; what a page asks for goes elsewhere.
OWN_HOSTS = ("google.com", "googleapis.com", "gstatic.com", "gvt1.com")

pytestmark = pytest.mark.skipif(CHROMIUM is None, reason="needs Chromium: apt install chromium")


@pytest.fixture(scope="module")
def reports(tmp_path_factory):
    """Reports of a film under its key and under another one, and of one in which a robot is covered."""
    folder = tmp_path_factory.mktemp("reports")
    save_key(KEY, folder / "robot.key")
    save_key(key_of(KEY.scheme, OTHER_SECRET), folder / "other.key")
    film_robots(folder / "film.mp4")
    for name, key, more in (
        ("decoded", "robot", ()), ("absent", "other", ()), ("inconclusive", "robot", ("--assign", "robot1=marker0"))
    ):  # fmt: skip
        with pytest.raises(SystemExit):
            main(["decode", str(folder / "film.mp4"), "--key", str(folder / f"{key}.key"), *more,
                  "--report", str(folder / f"{name}.html")])  # fmt: skip
    return folder


@pytest.mark.parametrize("verdict", ["decoded", "absent"])
def test_a_page_is_drawn_without_complaint_or_request(reports, tmp_path, verdict):
    page, picture, log = reports / f"{verdict}.html", tmp_path / "page.png", tmp_path / "net.json"
    done = subprocess.run(
        [CHROMIUM, "--headless", "--no-sandbox", "--disable-gpu", "--no-first-run", "--disable-background-networking",
         "--disable-component-update", "--disable-sync", "--hide-scrollbars", f"--user-data-dir={tmp_path / 'profile'}",
         f"--log-net-log={log}", "--enable-logging=stderr", f"--window-size={SIZE_PX[0]},{SIZE_PX[1]}",
         f"--screenshot={picture}", page.as_uri()],
        capture_output=True, text=True, timeout=PATIENCE_S, check=True,
    )  # fmt: skip
    assert [line for line in done.stderr.splitlines() if "CONSOLE" in line] == []
    assert asked_for(log) == []
    image = cv2.imread(str(picture))
    assert image.shape[1] == SIZE_PX[0]
    # The verdict in its colour, and a picture of the film, which is grey and wide.
    red, green = np.array([24, 35, 180]), np.array([55, 127, 26])
    colour = green if verdict == "decoded" else red
    assert np.sum(np.abs(image[:120].astype(int) - colour).sum(axis=2) < 30) > 500
    assert np.sum(np.abs(image.astype(int) - 255).sum(axis=2) > 60) > 0.1 * image.shape[0] * image.shape[1]


def asked_for(log):
    """Addresses of other machines that a page asked for."""
    events = json.loads(log.read_text(encoding="utf-8"))["events"]
    addresses = {str(event.get("params", {}).get("url", "")) for event in events}
    return sorted(
        address
        for address in addresses
        if address.startswith(("http:", "https:", "ws:", "wss:", "ftp:"))
        and not any(own in address for own in OWN_HOSTS)
    )
