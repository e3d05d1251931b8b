import os
import socket
from collections import namedtuple
from pathlib import Path

import pytest

from mtm_onboard.control.control_socket import ControlSocket
from mtm_onboard.doctor.places import check_control, check_journal, check_key_file, check_source
from mtm_onboard.runtime.config import ControlSettings, JournalSettings, SourceSettings
from mtm_onboard.runtime.datagram_source import UnixSource


@pytest.fixture
def key_file(tmp_path):
    path = tmp_path / "robot.key"
    path.touch(mode=0o600)
    tmp_path.chmod(0o700)
    return path


def test_a_key_of_one_s_own_in_a_folder_of_one_s_own_passes(key_file):
    assert check_key_file(key_file).status == "pass"


def test_a_key_that_others_may_replace_is_a_warning(key_file):
    key_file.parent.chmod(0o777)
    assert "chmod go-w" in check_key_file(key_file).text
    assert check_key_file(key_file).status == "warn"
    # As in /tmp, where only an owner removes its files.
    key_file.parent.chmod(0o1777)
    assert check_key_file(key_file).status == "pass"


def test_a_key_of_another_user_is_a_warning_to_look_as_that_user(key_file, monkeypatch):
    monkeypatch.setattr(os, "getuid", lambda: os.stat(key_file).st_uid + 54_321)
    assert check_key_file(key_file).status == "warn"
    assert "sudo -u" in check_key_file(key_file).text


def test_a_journal_with_room_passes_and_leaves_nothing_behind(tmp_path):
    assert check_journal(JournalSettings(str(tmp_path / "r.csv"), max_mb=1.0)).status == "pass"
    assert list(tmp_path.iterdir()) == []
    assert check_journal(None).status == "pass"


def test_a_folder_that_takes_no_file_is_a_failure(tmp_path):
    assert check_journal(JournalSettings(str(tmp_path / "nowhere" / "r.csv"))).status == "fail"
    assert check_journal(JournalSettings("/proc/r.csv")).status == "fail"


def test_a_disk_smaller_than_the_journal_s_bound_is_a_warning(tmp_path, monkeypatch):
    usage = namedtuple("usage", "total used free")
    monkeypatch.setattr("shutil.disk_usage", lambda folder: usage(10**9, 9 * 10**8, 10**8))
    found = check_journal(JournalSettings(str(tmp_path / "r.csv"), max_mb=200.0))
    assert found.status == "warn"
    assert found.figures == {"free_mb": 100.0, "max_mb": 200.0}


def test_a_free_control_socket_passes_and_is_not_left_behind(tmp_path):
    path = tmp_path / "r.sock"
    assert check_control(ControlSettings(str(path))).status == "pass"
    assert not path.exists()
    assert check_control(None).status == "pass"


def test_a_control_socket_of_another_run_is_a_failure_and_stays(tmp_path):
    path = tmp_path / "r.sock"
    with ControlSocket(path):
        assert check_control(ControlSettings(str(path))).status == "fail"
        assert path.exists()


def test_a_control_socket_in_no_folder_is_a_failure(tmp_path):
    assert check_control(ControlSettings(str(tmp_path / "nowhere" / "r.sock"))).status == "fail"
    assert not Path("/run/mtm-of-no-test").exists()
    assert check_control(ControlSettings("/run/mtm-of-no-test/r.sock")).status == "warn"


def test_a_port_for_base_commands_is_free_or_a_failure():
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as other:
        other.bind(("127.0.0.1", 0))
        port = other.getsockname()[1]
        assert check_source(SourceSettings("udp", port=port)).status == "fail"
    assert check_source(SourceSettings("udp", port=port)).status == "pass"
    assert check_source(SourceSettings("stdin")).status == "pass"


def test_a_socket_for_base_commands_can_be_made_or_is_a_failure(tmp_path):
    settings = SourceSettings("unix", str(tmp_path / "r.base"))
    assert check_source(settings).status == "pass"
    assert not (tmp_path / "r.base").exists()
    source = UnixSource(tmp_path / "r.base")
    assert check_source(settings).status == "fail"
    source.close()
    assert check_source(SourceSettings("unix", str(tmp_path / "nowhere" / "r.base"))).status == "fail"
    assert check_source(SourceSettings("unix", "/run/mtm-of-no-test/r.base")).status == "warn"
