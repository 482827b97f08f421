"""Clips: whole or not there, the oldest go, and what is damaged is only missing."""

import os

import pytest

from touchline.core.errors import DiskFull, NotFound
from touchline.detection import store as clips
from touchline.detection.store import LENGTH, ClipRepository

FRAMES = [{"seq": 4, "time_s": 10.0, "bytes": 3}, {"seq": 9, "time_s": 10.5, "bytes": 2}]
HEAD = {"width": 8, "height": 6, "frames": FRAMES}


@pytest.fixture
def saved(opener, tmp_path):
    with opener(tmp_path / "data") as store:
        yield store.repository(ClipRepository)


def added(saved, nth=0):
    clip = saved.add("north", HEAD, b"abcde")
    os.utime(saved.folder / f"{clip.id}.clip", (1000 + nth, 1000 + nth))
    return clip.id


def test_each_frame_is_read_back_and_the_newest_clip_comes_first(saved):
    assert saved.all() == ()
    first, second = added(saved, 0), added(saved, 1)
    assert [clip.id for clip in saved.all()] == [second, first]
    assert [saved.frame(first, n) for n in (0, 1)] == [b"abc", b"de"]
    told = saved.get(first).to_json()
    assert (told["frames"], told["seconds"], told["fps"], told["camera"]) == (2, 0.5, 2.0, "north")
    for number in (2, -1):
        with pytest.raises(NotFound) as refused:
            saved.frame(first, number)
        assert refused.value.reason == "unknown-frame"
    saved.delete(first)
    with pytest.raises(NotFound):
        saved.frame(first, 0)


def test_the_oldest_go_where_there_is_no_more_room(saved, monkeypatch):
    ids = [added(saved, n) for n in range(3)]
    size = (saved.folder / f"{ids[0]}.clip").stat().st_size
    monkeypatch.setattr(clips, "MAX_BYTES", 2 * size + 5)
    newest = added(saved, 9)
    assert [clip.id for clip in saved.all()] == [newest, ids[2], ids[1]]
    monkeypatch.setattr(clips, "MAX_BYTES", 3)
    with pytest.raises(DiskFull):
        saved.add("north", HEAD, b"abcde")


def test_the_newest_stays_after_the_clock_was_set_back(saved, monkeypatch):
    before = saved.add("north", HEAD, b"abcde")
    path = saved.folder / f"{before.id}.clip"
    tomorrow_s = path.stat().st_mtime + 86_400
    os.utime(path, (tomorrow_s, tomorrow_s))
    ids = [saved.add("north", HEAD, b"abcde").id for _ in range(2)]
    assert [clip.id for clip in saved.all()] == [ids[1], ids[0], before.id]
    monkeypatch.setattr(clips, "MAX_BYTES", 2 * path.stat().st_size + 5)
    newest = saved.add("north", HEAD, b"abcde").id
    assert [clip.id for clip in saved.all()] == [newest, *ids[::-1]]


@pytest.mark.parametrize(
    "data",
    [
        b"",
        b"\xff\xff\xff\xff{}",
        LENGTH.pack(2) + b"{}",
        LENGTH.pack(4) + b"\xff\xfe\0\0",
        LENGTH.pack(25) + b'{"frames":[{"bytes":-1}]}',
        LENGTH.pack(13) + b'{"frames":[]}',
    ],
)
def test_what_is_damaged_is_missing_and_hides_no_other(saved, data):
    whole = added(saved)
    damaged = "0" * 16
    (saved.folder / f"{damaged}.clip").write_bytes(data)
    assert [clip.id for clip in saved.all()] == [whole]
    for deed in (saved.get, saved.delete, lambda id: saved.frame(id, 0)):
        with pytest.raises(NotFound):
            deed(damaged)


@pytest.mark.parametrize("id", ["../../etc/passwd", "", "\0", "0" * 15, "G" * 16])
def test_a_name_that_could_be_a_path_is_no_clip(saved, id):
    with pytest.raises(NotFound):
        saved.frame(id, 0)
