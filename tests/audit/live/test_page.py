import json
import urllib.error
import urllib.request

import numpy as np
import pytest

from mtm_audit.live.events import Pose
from mtm_audit.live.page import HOST, Page
from mtm_audit.live.state import WatchState
from mtm_audit.model.picture import Frame
from mtm_onboard.protocol import MtmError
from tests.audit.live.watched import KEY
from tests.audit.moving_robot import FAKE_SECRET

EVIL = "<img src=x onerror=alert(1)>"


@pytest.fixture
def state():
    return WatchState("tcp://127.0.0.1:5005", KEY, 1e-4)


@pytest.fixture
def page(state):
    with Page(state) as served:
        yield served


def asked(page, path="/", **headers):
    request = urllib.request.Request(f"{page.url.rstrip('/')}{path}", headers=headers)
    with urllib.request.urlopen(request, timeout=10.0) as answer:
        return answer.status, answer.headers, answer.read()


def test_page_script_and_style_are_there(page):
    assert b"page.js" in asked(page)[2]
    assert asked(page, "/page.js")[1].get_content_type() == "text/javascript"
    assert asked(page, "/page.css")[1].get_content_type() == "text/css"


def test_nothing_on_the_page_comes_from_elsewhere(page):
    for path in ("/", "/page.js", "/page.css"):
        text = asked(page, path)[2].decode().replace("http://www.w3.org/2000/svg", "")
        assert "//" not in text.replace("// ", "")
    assert "default-src 'none'" in asked(page)[1]["Content-Security-Policy"]


@pytest.mark.parametrize(
    "host", ["evil.example", "evil.example:{port}", "127.0.0.1", "127.0.0.1:1", "[::1]:{port}", ""]
)
def test_who_asks_under_another_name_is_refused(page, host):
    with pytest.raises(urllib.error.HTTPError) as refusal:
        asked(page, "/state", Host=host.format(port=page.port))
    assert refusal.value.code in (400, 403)
    refusal.value.close()


def test_it_listens_on_the_loopback_alone(page):
    assert page.url.startswith(f"http://{HOST}:")
    assert [address[0] for address in page._runner.addresses] == ["127.0.0.1"]


def test_the_state_is_told_and_holds_no_secret(page, state):
    state.shown(Pose(EVIL, 1.0, 2.0, float("nan")), 1.0)
    state.noticed("the camera has dropped")
    body = asked(page, "/state")[2].decode()
    told = json.loads(body)
    assert told["places"] == {EVIL: [2.0, None]}
    assert told["notices"] == ["the camera has dropped"]
    assert told["stage"] == "watching"
    assert FAKE_SECRET.hex() not in body


def test_names_go_into_the_page_as_text_alone(page):
    script = asked(page, "/page.js")[2].decode()
    assert "innerHTML" not in script
    assert "insertAdjacentHTML" not in script
    assert "document.write" not in script


def test_the_picture_is_the_newest_with_what_is_seen(page, state):
    assert asked(page, "/picture")[0] == 204
    image = np.full((120, 160), 90, np.uint8)
    state.shown(Frame(0.0, image), 0.0, {"marker0": (80.0, 60.0)})
    status, headers, data = asked(page, "/picture")
    assert (status, headers.get_content_type()) == (200, "image/jpeg")
    assert data.startswith(b"\xff\xd8")
    assert (image == 90).all()


def test_a_port_that_is_taken_is_one_sentence(page, state):
    with pytest.raises(MtmError, match="cannot be served at port"), Page(state, page.port):
        pass
