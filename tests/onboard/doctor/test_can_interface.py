import pytest

from mtm_onboard.doctor.can_interface import check_interface, link_details

BITRATE = 1_000_000


def found(folder, *, details="sound", **entries):
    """What is found of can0 in a made-up /sys/class/net."""
    place = folder / "can0"
    place.mkdir()
    for name, text in ({"type": "280", "flags": "0x400c1", "tx_queue_len": "1000"} | entries).items():
        (place / name).write_text(f"{text}\n")
    sound = {"info_kind": "can", "info_data": {"state": "ERROR-ACTIVE", "bittiming": {"bitrate": BITRATE}}}
    return check_interface("can0", BITRATE, folder, lambda name: sound if details == "sound" else details)


def test_an_interface_that_is_up_at_the_robot_s_bit_rate_passes(tmp_path):
    assert found(tmp_path).status == "pass"


@pytest.mark.parametrize("name", ["can0", "", "../net"])
def test_an_interface_that_is_not_there_is_a_failure(tmp_path, name):
    assert check_interface(name, BITRATE, tmp_path / "net").status == "fail"


@pytest.mark.parametrize(
    ("entries", "details", "status", "words"),
    [
        ({"type": "1"}, "sound", "fail", "no CAN interface"),
        ({"flags": "0x40080"}, "sound", "fail", "ip link set can0 type can bitrate 1000000"),
        ({"tx_queue_len": "10"}, "sound", "warn", "txqueuelen 1000"),
        ({}, None, "warn", "install iproute2"),
        ({}, {"info_kind": "vcan"}, "pass", "virtual"),
        ({}, {"info_kind": "can", "info_data": {"bittiming": {"bitrate": 500_000}}}, "fail", "500000"),
        ({}, {"info_kind": "can"}, "fail", "bit rate None"),
        (
            {},
            {"info_data": {"state": "BUS-OFF", "bittiming": {"bitrate": BITRATE}}},
            "fail",
            "termination",
        ),
        (
            {},
            {"info_data": {"state": "ERROR-PASSIVE", "bittiming": {"bitrate": BITRATE}}},
            "warn",
            "ERROR-PASSIVE",
        ),
    ],
)
def test_what_keeps_frames_from_the_robot_is_said_with_a_remedy(tmp_path, entries, details, status, words):
    finding = found(tmp_path, details=details, **entries)
    assert finding.status == status
    assert words in finding.text


def test_an_interface_that_ip_does_not_know_has_no_details(monkeypatch):
    assert link_details("no-such-interface") is None
    monkeypatch.setattr("shutil.which", lambda name: None)
    assert link_details("lo") is None
