"""Decoding in processes that may die: honest pictures come through whole, and nothing else gets far."""

import os
import resource
import signal
import threading
import time
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from hashlib import sha256
from pathlib import Path
from struct import pack

import cv2
import numpy as np
import pytest

from tests.support.child_processes import pids_of
from tests.support.paths import SHARED_DATA
from tests.support.pictures import HOSTILE, encoded, gradient, hostile, jpeg_of_many_scans
from tests.support.waiting import LONG_S, gone, until
from touchline.core.errors import BadImage, BadInput, TouchlineError, Unavailable
from touchline.images import DeclaredImage, ImageDecoder, ImageLimits, encode, frame_from_bytes

SLOW_S = 1.5  # of processor time, which other work on the machine does not lengthen
LARGE_MB = 300
PATIENT = ImageLimits(wall_s=60.0)  # a busy machine may take longer than a server waits


@pytest.fixture(scope="module")
def decoder():
    with ImageDecoder(PATIENT) as decoder:
        yield decoder


@pytest.mark.parametrize("suffix", ["png", "bmp", "webp"])
def test_lossless_formats_come_through_to_the_bit(decoder, suffix):
    assert np.array_equal(decoder.frame_from_bytes(encoded(suffix)).pixels, gradient())


@pytest.mark.parametrize("suffix", ["jpg", "webp"])
def test_lossy_formats_come_through_nearly(decoder, suffix):
    quality = {"jpg": cv2.IMWRITE_JPEG_QUALITY, "webp": cv2.IMWRITE_WEBP_QUALITY}[suffix]
    pixels = decoder.frame_from_bytes(encoded(suffix, gradient(), quality, 95)).pixels
    assert np.abs(pixels.astype(int) - gradient()).mean() < 3  # grey levels, at quality 95


def test_grey_and_16_bit_pictures_become_bgr_of_8_bit(decoder):
    grey = gradient()[..., 0]
    for pixels in (grey, grey.astype(np.uint16) * 257, np.dstack([gradient(), grey])):
        frame = decoder.frame_from_bytes(encoded("png", pixels))
        assert frame.pixels.shape == (48, 64, 3) and frame.pixels.dtype == np.uint8


def test_a_frame_knows_its_bytes_and_cannot_be_changed(decoder):
    frame = decoder.frame_from_bytes(encoded("png"), camera="north")
    assert frame.sha256 == sha256(encoded("png")).hexdigest() and frame.camera == "north"
    with pytest.raises(ValueError, match="read-only"):
        frame.pixels[0, 0] = 0


def test_the_exif_orientation_is_left_alone(decoder):
    quarter_turn = b"Exif\0\0MM\0*\0\0\0\x08\0\x01\x01\x12\0\x03\0\0\0\x01\0\x06\0\0\0\0\0\0"
    plain = encoded("jpg")
    data = plain[:2] + b"\xff\xe1" + pack(">H", len(quarter_turn) + 2) + quarter_turn + plain[2:]
    turned = cv2.imdecode(np.frombuffer(data, np.uint8), cv2.IMREAD_COLOR)
    assert turned.shape == (64, 48, 3), "the picture under test carries no orientation"
    assert decoder.frame_from_bytes(data).pixels.shape == (48, 64, 3)


@pytest.mark.parametrize("name", HOSTILE)
def test_a_hostile_picture_costs_little_and_is_refused(decoder, name):
    data, reason = hostile(name)
    cost = Cost.of(decoder, data)
    assert cost.outcome == reason
    assert cost.seconds <= SLOW_S and cost.child_mb <= LARGE_MB and cost.parent_mb <= LARGE_MB


def test_every_hostile_file_beside_the_project_costs_little_and_breaks_nothing(decoder):
    folder = SHARED_DATA / "hostile_images"
    files = sorted(path for path in folder.glob("*") if path.name != "SOURCE.txt")
    if not files:
        pytest.skip(f"no hostile pictures in {folder}")
    costs = {path.name: Cost.of(decoder, path.read_bytes()) for path in files}
    slow = {name: c for name, c in costs.items() if c.seconds > SLOW_S}
    large = {name: c for name, c in costs.items() if max(c.child_mb, c.parent_mb) > LARGE_MB}
    assert not slow and not large
    assert not any(c.died for c in costs.values()), (
        "none of them gets far enough to break a decoder"
    )
    decoded = sum(c.outcome == "decoded" for c in costs.values())
    assert decoded > 100, "the screen is no wall: harmless ones among them still decode"
    worst = {
        name: max(getattr(c, name) for c in costs.values())
        for name in ("seconds", "child_mb", "parent_mb")
    }
    print(
        f"{len(costs)} files, {decoded} decoded, {sum(c.seconds for c in costs.values()):.2f} s; worst: {worst}"
    )


@dataclass(frozen=True)
class Cost:
    """What one picture took, and how it ended: "decoded" or the reason of its refusal."""

    outcome: str
    seconds: float  # of processor time, of this thread and the decoding processes
    child_mb: float  # largest resident memory of a decoding process
    parent_mb: float  # by how much ours grew; the tests before this one have left much in it
    died: bool  # whether a decoding process did not live through it

    @classmethod
    def of(cls, decoder, data):
        children = pids_of(decoder)
        for pid in (*children, os.getpid()):
            Path(f"/proc/{pid}/clear_refs").write_text("5")  # the high-water mark starts anew
        before_mb = memory_mb(os.getpid(), "VmRSS")
        begin, outcome = time.thread_time() + sum(map(cpu_s, children)), "decoded"
        try:
            decoder.frame_from_bytes(data)
        except TouchlineError as refusal:
            outcome = refusal.reason
        alive = [pid for pid in children if pid in pids_of(decoder)]
        seconds = (
            time.thread_time() + sum(map(cpu_s, alive)) - begin
            if alive == list(children)
            else np.nan
        )
        return cls(
            outcome,
            seconds,
            max((memory_mb(pid, "VmHWM") for pid in alive), default=0.0),
            memory_mb(os.getpid(), "VmHWM") - before_mb,
            died=len(alive) < len(children),
        )


def memory_mb(pid, which):
    return int(Path(f"/proc/{pid}/status").read_text().split(f"{which}:")[1].split()[0]) / 1024


def cpu_s(pid):
    used = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[11:13]
    return sum(map(int, used)) / os.sysconf("SC_CLK_TCK")


def test_pixels_of_another_size_than_declared_are_refused(decoder):
    # No bytes are known that get the screen and the decoder to disagree, so the declaration is made to.
    with pytest.raises(BadImage) as refusal:
        decoder._decode(encoded("png"), DeclaredImage("png", 65, 48))
    assert refusal.value.reason == "image-size-mismatch" and "64 × 48" in refusal.value.what


def test_a_decoder_killed_while_idle_is_replaced_unseen():
    with ImageDecoder(workers=1) as decoder:
        decoder.frame_from_bytes(encoded("png"))
        (pid,) = pids_of(decoder)
        os.kill(pid, signal.SIGKILL)
        until(lambda: gone(pid))
        assert np.array_equal(decoder.frame_from_bytes(encoded("png")).pixels, gradient())
        assert pids_of(decoder) != (pid,)


def test_a_decoder_killed_amid_a_picture_refuses_it_and_the_next_one_decodes(monkeypatch):
    with ImageDecoder(workers=1) as decoder, ThreadPoolExecutor(1) as thread:
        decoder.frame_from_bytes(encoded("png"))
        (pid,) = pids_of(decoder)
        os.kill(pid, signal.SIGSTOP)  # holds it in the middle, however fast the machine
        (worker,), begun = decoder._all, threading.Event()
        connection = worker._child.connection  # waits for the answer once the picture has been sent
        monkeypatch.setattr(
            connection, "receive", lambda s, wait=connection.receive: (begun.set(), wait(s))[1]
        )
        first = thread.submit(decoder.frame_from_bytes, encoded("png"))
        assert begun.wait(LONG_S)
        os.kill(pid, signal.SIGKILL)
        with pytest.raises(BadImage) as refusal:
            first.result()
        assert refusal.value.reason == "undecodable-image"
        assert np.array_equal(decoder.frame_from_bytes(encoded("png")).pixels, gradient())


def test_a_picture_that_takes_too_long_is_refused_in_time_and_its_process_is_gone():
    slow = jpeg_of_many_scans(40, 7000, 7000)
    with ImageDecoder(ImageLimits(wall_s=0.2), workers=1) as decoder:
        decoder.frame_from_bytes(encoded("png"))
        (pid,) = pids_of(decoder)
        begin = ended_children_s() + cpu_s(pid)
        with pytest.raises(BadImage) as refusal:
            decoder.frame_from_bytes(slow)
        assert refusal.value.reason == "slow-image"
        # of its own processor time; whole, it takes several seconds
        assert ended_children_s() - begin < 1.0
        with pytest.raises(ProcessLookupError):
            os.kill(pid, 0)
        assert decoder.frame_from_bytes(encoded("png")).size.width == 64


def ended_children_s():
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


def test_a_picture_that_needs_more_memory_than_a_decoder_has_is_refused_and_the_decoder_lives():
    with ImageDecoder(ImageLimits(memory_bytes=400 * 2**20), workers=1) as decoder:
        decoder.frame_from_bytes(encoded("png"))
        pids = pids_of(decoder)
        with pytest.raises(BadImage) as refusal:
            decoder.frame_from_bytes(encoded("jpg", np.zeros((7000, 7000, 3), np.uint8)))
        assert refusal.value.reason == "image-needs-memory"
        assert decoder.frame_from_bytes(encoded("png")).size.width == 64
        assert pids_of(decoder) == pids


def test_a_decoder_gives_a_large_picture_s_memory_back():
    with ImageDecoder(PATIENT, workers=1) as decoder:
        decoder.frame_from_bytes(encoded("png"))
        (pid,) = pids_of(decoder)
        before_mb = memory_mb(pid, "VmRSS")
        decoder.frame_from_bytes(encoded("jpg", np.zeros((5000, 5000, 3), np.uint8)))  # 75 MB
        until(lambda: memory_mb(pid, "VmRSS") - before_mb < 20)


def test_the_decoding_process_can_write_no_file_and_knows_no_setting(monkeypatch):
    monkeypatch.setenv("TOUCHLINE_TOKEN", "secret")
    with ImageDecoder(workers=1) as decoder:
        decoder.frame_from_bytes(encoded("png"))
        (pid,) = pids_of(decoder)
        limits = Path(f"/proc/{pid}/limits").read_text()
        environment = Path(f"/proc/{pid}/environ").read_bytes()
    bounds = {line[:25].strip(): line[26:].split()[:2] for line in limits.splitlines()}
    assert bounds["Max address space"] == [str(2**30)] * 2
    assert bounds["Max file size"] == ["0", "0"]
    assert b"TOUCHLINE_TOKEN" not in environment and b"PATH" in environment


def test_many_threads_get_their_own_pictures(decoder):
    pictures = [gradient(60 + k, 40) for k in range(40)]
    with ThreadPoolExecutor(16) as threads:
        frames = threads.map(decoder.frame_from_bytes, [encoded("png", p) for p in pictures])
    assert all(np.array_equal(frame.pixels, p) for frame, p in zip(frames, pictures, strict=True))


def test_whoever_finds_every_decoder_busy_is_told_to_come_back():
    with ImageDecoder(workers=1, patience_s=0.1) as decoder:
        decoder.frame_from_bytes(encoded("png"))
        (pid,) = pids_of(decoder)
        os.kill(pid, signal.SIGSTOP)
        with ThreadPoolExecutor(1) as thread:
            first = thread.submit(decoder.frame_from_bytes, encoded("png"))
            until(decoder._free.empty)
            with pytest.raises(Unavailable, match="at once"):
                decoder.frame_from_bytes(encoded("png"))
            os.kill(pid, signal.SIGCONT)
            assert first.result().size.width == 64


def test_closing_ends_every_process_even_amid_a_picture():
    decoder = ImageDecoder(workers=2)
    decoder.frame_from_bytes(encoded("png"))
    pids = pids_of(decoder)
    for pid in pids:
        os.kill(pid, signal.SIGSTOP)
    with ThreadPoolExecutor(3) as threads:
        waiting = [threads.submit(decoder.frame_from_bytes, encoded("png")) for _ in range(3)]
        until(decoder._free.empty)
        decoder.close()
        for one in waiting:
            with pytest.raises(Unavailable):
                one.result()
    for pid in pids:
        with pytest.raises(ProcessLookupError):
            os.kill(pid, 0)
    with pytest.raises(Unavailable):
        decoder.frame_from_bytes(encoded("png"))


def test_a_shell_reads_one_picture_without_a_decoder_of_its_own():
    assert frame_from_bytes(encoded("jpg")).size.width == 64


def test_what_is_encoded_as_png_comes_back_to_the_bit(decoder):
    assert np.array_equal(decoder.frame_from_bytes(encode(gradient(), "png")).pixels, gradient())


def test_a_higher_jpeg_quality_gives_a_larger_and_truer_file(decoder):
    low, high = encode(gradient(), "jpg", 20), encode(gradient(), "jpg", 95)
    error = [
        np.abs(decoder.frame_from_bytes(data).pixels.astype(int) - gradient()).mean()
        for data in (low, high)
    ]
    assert len(low) < len(high) and error[0] > error[1]


@pytest.mark.parametrize(
    ("format", "quality", "reason"),
    [("gif", 90, "unknown-image-format"), ("jpg", 0, "bad-quality"), ("jpg", 101, "bad-quality")],
)
def test_an_encoding_that_does_not_exist_is_refused(format, quality, reason):
    with pytest.raises(BadInput) as refusal:
        encode(gradient(), format, quality)
    assert refusal.value.reason == reason
