import os
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mtm_onboard.protocol import Channel, Codebook, Key, MtmError, Scheme, generate_key, load_key, save_key
from mtm_onboard.protocol.key import key_text

FAKE_SECRET = b"not a real secret, only for test"
SCHEME = Scheme(
    name="test",
    rate_hz=50.0,
    band_hz=(0.5, 5.0),
    alphabet_size=4,
    message_ticks=600,
    channels=(Channel("a", "a", ("vx", "vy"), 2, 0.1), Channel("b", "b", ("vx",), 3, 0.1)),
)


@pytest.fixture
def written(tmp_path):
    path = tmp_path / "robot.key"
    save_key(Key("fleet-7", FAKE_SECRET, SCHEME), path)
    return path


def edited(path, old, new):
    text = path.read_text()
    assert old in text
    path.write_text(text.replace(old, new))
    return path


def test_only_its_owner_reads_a_key_file(written):
    assert load_key(written) == Key("fleet-7", FAKE_SECRET, SCHEME)
    assert os.stat(written).st_mode & 0o777 == 0o600


def test_two_generated_keys_differ_and_hide_their_secret():
    one, other = generate_key("a", SCHEME), generate_key("a", SCHEME)
    assert one.secret != other.secret
    assert one.secret.hex() not in repr(one)
    assert repr(one.secret) not in repr(one)


def test_an_existing_key_file_is_never_overwritten(written):
    before = written.read_bytes()
    with pytest.raises(MtmError, match="exists already"):
        save_key(generate_key("other", SCHEME), written)
    assert written.read_bytes() == before


@pytest.mark.parametrize(
    ("old", "new", "says"),
    [
        ("format = 1", "format = 2", "the kind is None"),
        ("format = 1", "format = 3", "key format 3"),
        ("format = 1", "", "lacks|format None"),
        ("format = 1", "format = true", "key format True"),
        ('id = "fleet-7"', 'id = "fleet\\u0007"', "key id"),
        ('id = "fleet-7"', "id = 7", "key id 7"),
        ("[scheme]", "[scheme", "not valid TOML"),
        ('id = "fleet-7"', 'id = "fleet-7"\ncolour = "red"', "unknown field 'colour'"),
        ("band_hz = [0.5, 5.0]", "band_hz = [0.5, 25.0]", "below 25.0 Hz"),
        ("band_hz = [0.5, 5.0]", "band_hz = [5.0, 0.5]", "lower edge first"),
        ("band_hz = [0.5, 5.0]", "band_hz = 5", "two numbers"),
        ("version = 1", "version = 9", "version 9"),
        ("message_ticks = 600", "message_ticks = 601", "do not divide"),
        ("message_ticks = 600", "message_ticks = 12", "shortest window that works is 20"),
        ("alphabet_size = 4", "alphabet_size = 1", "2 to 65536"),
        ("alphabet_size = 4", "alphabet_size = 4.5", "whole number"),
        ("message_ticks = 600", "message_ticks = 1000000000000", "4194304 at most"),
        ("rate_hz = 50.0", "rate_hz = 1e308", "1e\\+06 at most"),
        ("sigma = 0.1", "sigma = nan", "above zero"),
        ("sigma = 0.1", 'sigma = 0.1\nextra = "x"', "unknown field 'extra'"),
        ('power = "window"', 'power = "loud"', "ensemble, window"),
        ('axes = ["vx"]', "axes = []", "one or more axes"),
        ("rate_hz = 50.0", 'rate_hz = "fast"', "above zero"),
        ("symbols = 3", "symbols = 0", "at least 1"),
        ('name = "b"', 'name = "a"', "same name"),
    ],
)
def test_a_bad_key_file_says_what_to_change(written, old, new, says):
    with pytest.raises(MtmError, match=says) as refusal:
        load_key(edited(written, old, new))
    assert "\n" not in str(refusal.value)
    assert FAKE_SECRET.hex() not in str(refusal.value)


def test_a_wrong_secret_length_is_refused_without_showing_it(written):
    with pytest.raises(MtmError, match="64 hexadecimal digits") as refusal:
        load_key(edited(written, FAKE_SECRET.hex(), FAKE_SECRET.hex()[:-2]))
    assert FAKE_SECRET.hex()[:20] not in str(refusal.value)


def test_a_key_file_others_can_read_is_refused(written):
    os.chmod(written, 0o640)
    with pytest.raises(MtmError, match="chmod 600"):
        load_key(written)


def test_missing_folder_and_binary_files_are_refused(tmp_path):
    with pytest.raises(MtmError, match="cannot read"):
        load_key(tmp_path / "absent.key")
    with pytest.raises(MtmError, match="not a file|cannot read"):
        load_key(tmp_path)
    binary = tmp_path / "binary.key"
    binary.write_bytes(bytes(range(128, 256)))
    os.chmod(binary, 0o600)
    with pytest.raises(MtmError, match="is no key file"):
        load_key(binary)


def test_a_scheme_that_is_no_table_is_refused(written):
    text = written.read_text()
    written.write_text(text[: text.index("[scheme]")] + "scheme = 3\n")
    with pytest.raises(MtmError, match="the scheme must be a table"):
        load_key(written)


def test_what_is_no_regular_file_is_refused():
    with pytest.raises(MtmError, match="/dev/null is not a file .*; name the key file"):
        load_key(Path("/dev/null"))


def test_a_key_s_codebook_is_that_of_its_secret_and_scheme():
    key = Key("fake-key", FAKE_SECRET, SCHEME)
    channel, own = SCHEME.channels[0], Codebook(FAKE_SECRET, SCHEME, 5)
    assert np.array_equal(key.codebook(5).samples(channel, 1), own.samples(channel, 1))
    assert (key.codebook().first_slot, key.codebook(5).first_slot) == (0, 5)


def test_key_ids_are_plain_words():
    with pytest.raises(MtmError, match="key id"):
        generate_key('bad"id', SCHEME)


@given(cut=st.integers(0, 700))
def test_a_truncated_key_file_never_raises_anything_else(tmp_path_factory, cut):
    text = key_text(Key("fleet-7", FAKE_SECRET, SCHEME))
    path = tmp_path_factory.mktemp("cut") / "cut.key"
    path.write_text(text[: min(cut, len(text) - 2)])
    os.chmod(path, 0o600)
    try:
        loaded = load_key(path)
    except MtmError:
        return
    # A cut between two channels leaves a complete, smaller scheme; nothing else may load.
    assert loaded.scheme.channels == SCHEME.channels[:1]


def test_the_fingerprint_changes_with_every_parameter():
    from dataclasses import replace

    variants = [
        SCHEME,
        replace(SCHEME, name="other"),
        replace(SCHEME, rate_hz=40.0),
        replace(SCHEME, alphabet_size=8),
        replace(SCHEME, epoch=1),
        replace(SCHEME, schedule="rolling"),
        replace(SCHEME, channels=SCHEME.channels[:1]),
    ]
    assert len({variant.fingerprint for variant in variants}) == len(variants)
