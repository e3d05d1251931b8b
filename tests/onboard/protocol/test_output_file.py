"""What stands where a command writes is the command's own, or stays."""

import os
import zlib
from dataclasses import replace
from datetime import UTC, datetime

import pytest
from hypothesis import given
from hypothesis import strategies as st

from mtm_onboard.firmware.device_key import new_device_key
from mtm_onboard.protocol import Key, MtmError, save_key
from mtm_onboard.protocol.atomicfile import replacing
from mtm_onboard.protocol.disclosure import anchor_of, save_anchor, save_disclosed
from mtm_onboard.protocol.key import generate_master, load_key
from mtm_onboard.protocol.output_file import check_outputs, heading_of, mark_of, marked_png, output_file
from mtm_onboard.protocol.secret_file import holds_secret
from tests.onboard.schemes import FAKE_SECRET, small_scheme

COMMAND = "mtm-audit plan"
PNG = b"\x89PNG\r\n\x1a\n" + (13).to_bytes(4, "big") + b"IHDR" + b"\0" * 17 + b"\0\0\0\0IEND\xaeB`\x82"


@pytest.fixture
def path(tmp_path):
    return tmp_path / "result"


def keys_in(folder):
    """A file of every kind that holds a secret, or what verifies one."""
    rolling = replace(small_scheme(), schedule="rolling")
    start = datetime(2026, 1, 1, tzinfo=UTC).date()
    master = generate_master("fake", rolling, start, 30)
    held = master.secret
    save_key(Key("fake", FAKE_SECRET, small_scheme()), folder / "format1.key")
    save_key(master, folder / "master.key")
    save_key(Key("fake", held.for_auditor(start, start, None), rolling), folder / "auditor.key")
    save_key(Key("fake", held.for_robot(["a"], start, start, None), rolling), folder / "robot.key")
    save_disclosed(Key("fake", held.disclosed(start), rolling), folder / "day.key")
    save_anchor(anchor_of(master), folder / "anchor.key")
    new_device_key(folder / "device.key")
    return sorted(folder.iterdir())


def written(path, **options):
    with output_file(path, COMMAND, **options) as temporary:
        temporary.write_text(f"{heading_of(COMMAND)}new\n")
    return path.read_text().endswith("new\n")


@pytest.mark.parametrize(
    "own",
    [
        b"", b"# mtm-audit plan\nold", b"# mtm-audit plan: 8 bits\nold", b"# mtm-audit plan --bits 8\r\nold",
        b"%PDF-1.4 /Creator (made by mtm-audit plan) %%EOF", b"<!doctype html><meta content='made by mtm-audit plan'>",
        b"\0\0\0\x1cftypisom" + bytes(5_000_000) + b"made by mtm-audit plan", marked_png(PNG, COMMAND),
    ],
)  # fmt: skip
def test_a_command_replaces_what_it_made(path, own):
    path.write_bytes(own)
    assert written(path)


@pytest.mark.parametrize(
    "foreign",
    [
        b"notes", b"a = 1\n", PNG, b"# mtm-audit planning\n", b"# mtm-audit decode\n", b"x\n# mtm-audit plan\n",
        b"I ran mtm-audit plan: made by mtm-audit plan\n", b"\0\0\0\x1cftypisom", b"# mtm-audit", b"\xff\xfe\0",
        marked_png(PNG, "mtm-audit decode"),
    ],
)  # fmt: skip
def test_what_it_did_not_make_stays_unless_forced(path, foreign):
    path.write_bytes(foreign)
    with pytest.raises(MtmError, match="was not made by mtm-audit plan; choose another name, or .* --force$"):
        written(path)
    assert path.read_bytes() == foreign
    assert os.listdir(path.parent) == ["result"]
    assert written(path, force=True)


@pytest.mark.parametrize("force", [False, True])
def test_no_key_file_of_any_kind_is_ever_replaced(tmp_path, force):
    files = keys_in(tmp_path)
    before = [file.read_bytes() for file in files]
    assert len(files) == 7
    for file in files:
        with pytest.raises(MtmError, match="is a key file, and no command replaces one; choose another name"):
            written(file, force=force)
        with pytest.raises(MtmError, match="is a key file"), replacing(file):
            raise AssertionError("the work was done in vain")
    assert [file.read_bytes() for file in files] == before
    assert load_key(tmp_path / "format1.key").id == "fake"


def test_a_key_made_while_a_command_works_is_spared(path):
    key = Key("fake", FAKE_SECRET, small_scheme())
    with pytest.raises(MtmError, match="is a key file"), replacing(path):
        save_key(key, path)
    assert load_key(path) == key


@pytest.mark.parametrize("cut", [60, 120, 300])
def test_a_damaged_key_file_counts_as_one(path, cut):
    save_key(Key("fake", FAKE_SECRET, small_scheme()), path)
    path.write_bytes(b"# mtm-audit plan: written over by hand\n" + path.read_bytes()[:cut])
    assert holds_secret(path)


@pytest.mark.parametrize(
    "text", ['{"sha256": "' + "ab" * 32 + '"}', "hash\n" + "ab" * 32 + "\n", "[link]\nkind = 1\n", ""]
)
def test_a_hash_is_no_secret(path, text):
    path.write_text(text)
    assert not holds_secret(path)


def test_a_header_or_a_magic_number_can_be_the_mark(path):
    path.write_bytes(b"MTMI....")
    assert written(path, begins=(b"MTMI", b"MTMS"))


def test_two_results_need_two_names(path):
    with pytest.raises(MtmError, match="named for two results"):
        check_outputs(COMMAND, path, None, path.parent / "." / "result")
    check_outputs(COMMAND, None, path, None)


def test_devices_and_links_to_nothing_are_refused(path):
    path.symlink_to(path.parent / "nowhere")
    with pytest.raises(MtmError, match="link to nothing"):
        written(path, force=True)
    for place, refusal in (("/dev/null", "device; name a file"), (str(path.parent), "folder, pipe"),
                           (str(path.parent / "none" / "x"), "there is no folder")):  # fmt: skip
        with pytest.raises(MtmError, match=refusal):
            check_outputs(COMMAND, type(path)(place), force=True)


def test_a_link_to_a_key_file_is_refused(path):
    save_key(Key("fake", FAKE_SECRET, small_scheme()), path.parent / "r.key")
    path.symlink_to(path.parent / "r.key")
    with pytest.raises(MtmError, match="is a key file"):
        written(path, force=True)


@given(st.binary(max_size=300))
def test_no_unmarked_content_counts_as_made(tmp_path_factory, data):
    path = tmp_path_factory.mktemp("any") / "x"
    path.write_bytes(data)
    own = not data or data.startswith(b"# mtm-audit plan") or mark_of(COMMAND).encode() in data
    if own:
        return
    with pytest.raises(MtmError):
        check_outputs(COMMAND, path)


def test_a_marked_picture_is_a_sound_one():
    data = marked_png(PNG, COMMAND)
    length = int.from_bytes(data[33:37], "big")
    assert data[37:41] == b"tEXt"
    assert int.from_bytes(data[41 + length : 45 + length], "big") == zlib.crc32(data[37 : 41 + length])
    assert data[45 + length :] == PNG[33:]
