import os
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mtm_audit.batch.trackcache import TrackCache, usual_folder
from mtm_audit.model.recorded_at import RecordedAt
from mtm_audit.model.recording import Recording
from mtm_audit.model.track import Track
from mtm_onboard.protocol import MtmError

NAME = "ab" * 32
TIMES_S = np.arange(50) / 30.0


def track(name, **changes):
    positions = np.random.default_rng(1).standard_normal((50, 2))
    positions[3] = np.nan
    return Track(**{"name": name, "times_s": TIMES_S, "positions": positions, "valid": np.arange(50) != 3} | changes)


def recording(path="/films/a.mp4", **changes):
    tracks = (
        track("marker3", unit="px", headings_rad=np.linspace(0, 1, 50), extent_px=np.float64(33.3)),
        track("arm", axes=("inner", "outer"), unit="rad"),
    )
    warnings = (f"{path} has no times", "dark")
    return Recording(
        **{
            "paths": (Path(path),),
            "kind": "video",
            "tracks": tracks,
            "warnings": warnings,
            "at": RecordedAt(1.7e9, 2.0),
        }
        | changes
    )


@pytest.fixture
def cache(tmp_path):
    return TrackCache(tmp_path / "cache")


def test_a_recording_comes_back_bit_by_bit(cache):
    kept = recording()
    cache.keep(NAME, kept)
    found = cache.find(NAME, kept.paths)
    assert (found.paths, found.kind, found.warnings, found.at) == (kept.paths, "video", kept.warnings, kept.at)
    for before, after in zip(kept.tracks, found.tracks, strict=True):
        plain = ("name", "axes", "unit", "extent_px")
        assert [getattr(before, name) for name in plain] == [getattr(after, name) for name in plain]
        for name in ("times_s", "positions", "valid", "headings_rad"):
            np.testing.assert_array_equal(getattr(before, name), getattr(after, name), strict=True)


def test_a_copy_elsewhere_is_named_where_it_lies(cache):
    cache.keep(NAME, recording(at=None))
    found = cache.find(NAME, (Path("/usb/a.mp4"),))
    assert (found.warnings, found.at) == (("/usb/a.mp4 has no times", "dark"), None)


def test_what_was_not_kept_is_not_found(cache):
    assert cache.find(NAME, ()) is None


@given(st.data())
def test_a_damaged_entry_is_not_used(tmp_path_factory, data):
    cache = TrackCache(tmp_path_factory.mktemp("cache"))
    cache.keep(NAME, recording())
    (entry,) = cache.folder.iterdir()
    whole = entry.read_bytes()
    cut = data.draw(st.integers(0, len(whole) - 1))
    flipped = data.draw(st.booleans())
    damaged = whole[:cut] + (bytes([whole[cut] ^ 1]) + whole[cut + 1 :] if flipped else b"")
    entry.write_bytes(damaged)
    assert cache.find(NAME, ()) is None
    cache.keep(NAME, recording())
    assert entry.read_bytes() == whole


def test_what_was_used_longest_ago_makes_room(cache):
    cache.keep("a" * 64, recording())
    size = (cache.folder / ("a" * 64 + ".tracks")).stat().st_size
    small = TrackCache(cache.folder, most_bytes=2 * size)
    small.keep("b" * 64, recording())
    for name, second in (("a", 2), ("b", 1)):
        os.utime(cache.folder / (name * 64 + ".tracks"), (second, second))
    small.keep("c" * 64, recording())
    assert sorted(path.name[0] for path in cache.folder.iterdir()) == ["a", "c"]


def test_use_keeps_an_entry_young(cache):
    cache.keep(NAME, recording())
    (entry,) = cache.folder.iterdir()
    os.utime(entry, (1, 1))
    cache.find(NAME, ())
    assert entry.stat().st_mtime > 1e9


def test_a_folder_that_cannot_be_made_gets_one_sentence(tmp_path):
    (tmp_path / "file").touch()
    with pytest.raises(MtmError, match="cannot make .*: .*; name another folder with --cache"):
        TrackCache(tmp_path / "file" / "cache").check()
    TrackCache(tmp_path / "file" / "cache").keep(NAME, recording())


def test_the_usual_folder_is_where_the_system_says(monkeypatch, tmp_path):
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    assert usual_folder() == tmp_path / "mtm" / "tracks"
    for value in ("", "relative"):
        monkeypatch.setenv("XDG_CACHE_HOME", value)
        assert usual_folder() == Path.home() / ".cache" / "mtm" / "tracks"


def test_nobody_else_reads_what_is_kept(cache):
    cache.keep(NAME, recording())
    (entry,) = cache.folder.iterdir()
    assert (cache.folder.stat().st_mode & 0o077, entry.stat().st_mode & 0o077) == (0, 0)
