"""H.264 over RTP and UDP: what is lost is not shown smeared, and nothing that arrives does harm."""

import random
import resource
import threading
import time
from contextlib import closing
from pathlib import Path

import numpy as np
import pytest

from tests.support.rtp_sender import (
    H264Sender,
    LossyRelay,
    carpet,
    free_group,
    free_port,
    loopback_socket,
    packets_of,
    sent_to_group,
)
from tests.support.waiting import until
from touchline.core.errors import BadInput, Conflict, TouchlineError, Unavailable
from touchline.sources import SourceContext, source_from_url
from touchline.sources.network.datagrams import Stream
from touchline.sources.network.rtp import H264Depacketiser, ReorderBuffer, read_rtp

AROUND = SourceContext(hosts=("127.0.0.1",))
PATIENT = "open_s=30"  # of a busy machine
SIZE = 640, 480


def textured(n: int) -> np.ndarray:
    """A picture whose key frame has many packets."""
    noise = np.random.default_rng(n % 7).integers(0, 60, (*SIZE[::-1], 3), dtype=np.uint8)
    return carpet(n, *SIZE) // 2 + noise


def opened(url: str):
    return closing(source_from_url(url + ("&" if "?" in url else "?") + PATIENT, AROUND))


def shown(packets: list[bytes]) -> list:
    """The pictures that a new stream gives of these datagrams."""
    stream, pictures = None, []
    for data in packets:
        packet = read_rtp(data)
        stream = stream or Stream(packet.kind if packet else None)
        pictures += stream.push(data, packet)
    return pictures


def is_key(data: bytes) -> bool:
    packet = read_rtp(data)
    return packet is not None and packet.first_nal in (5, 7)


def content(picture) -> bytes:
    return picture.to_ndarray(format="bgr24").tobytes()


@pytest.fixture(scope="module")
def sent() -> list[bytes]:
    """Real datagrams of FFmpeg's RTP: a key frame every ten pictures."""
    return packets_of(textured, 120, gop=10)


def test_every_picture_is_shown_where_nothing_is_lost(sent):
    pictures = shown(sent)
    assert len(pictures) >= 120 and len({content(one) for one in pictures}) > 100
    assert {(one.width, one.height) for one in pictures} == {SIZE}


@pytest.mark.parametrize("share", [0.02, 0.2])
def test_what_is_shown_despite_losses_is_whole_and_every_whole_key_frame_is_shown(sent, share):
    whole = {content(one) for one in shown(sent)}
    lottery = random.Random(1)
    left = [data for data in sent if lottery.random() > share]
    pictures = shown(left)
    assert {content(one) for one in pictures} <= whole

    def parts(packets):
        """The packets of each key frame, by its moment."""
        moments = {read_rtp(data).timestamp for data in packets if is_key(data)}
        found = {moment: [] for moment in moments}
        for packet in map(read_rtp, packets):
            if packet.timestamp in found:
                found[packet.timestamp].append(packet.sequence)
        return found

    before, after = parts(sent), parts(left)
    arrived = [moment for moment in before if after.get(moment) == before[moment]]
    keys = sum(one.key_frame for one in pictures)
    assert keys >= 0.95 * len(arrived)
    if share == 0.02:
        assert len(arrived) >= 3 and len(pictures) > 12


def test_after_a_picture_that_is_lost_altogether_none_is_shown_up_to_the_next_key_frame(sent):
    moments = list(dict.fromkeys(read_rtp(data).timestamp for data in sent))
    lost = moments[23]
    pictures = shown([data for data in sent if read_rtp(data).timestamp != lost])
    assert [content(one) for one in pictures] == [
        content(one) for n, one in enumerate(shown(sent)) if not 23 <= n < 30
    ]


def test_small_key_frames_nearly_all_survive_two_percent():
    sent = packets_of(lambda n: carpet(n, 64, 48), 300, gop=2)
    lottery = random.Random(2)
    pictures = shown([data for data in sent if lottery.random() > 0.02])
    keys = len({read_rtp(data).timestamp for data in sent if is_key(data)})
    assert keys > 100 and sum(one.key_frame for one in pictures) >= 0.95 * keys


def test_packets_that_overtake_and_come_twice_change_nothing(sent):
    mixed = list(sent[:600])
    lottery = random.Random(3)
    for i in range(60, len(mixed) - 4, 4):  # the first one is taken as the beginning
        part = mixed[i : i + 4]
        lottery.shuffle(part)
        mixed[i : i + 4] = part
    twice = [data for data in mixed for _ in range(2)]
    assert [content(one) for one in shown(twice)][1:] == [
        content(one) for one in shown(sent[:600])
    ][1:]


def test_numbers_and_moments_go_on_behind_their_largest(sent):
    def moved(data: bytes) -> bytes:
        number = (int.from_bytes(data[2:4], "big") - first + 65_500) & 0xFFFF
        moment = (int.from_bytes(data[4:8], "big") - begun + 0xFFFF0000) & 0xFFFFFFFF
        return data[:2] + number.to_bytes(2, "big") + moment.to_bytes(4, "big") + data[8:]

    first, begun = (int.from_bytes(sent[0][part], "big") for part in (slice(2, 4), slice(4, 8)))
    assert [content(one) for one in shown([moved(data) for data in sent])] == [
        content(one) for one in shown(sent)
    ]


def test_a_transport_stream_inside_udp_and_bare_h264_are_recognised_by_their_bytes():
    for form in ("mpegts", "h264"):
        with sent_to_group(form, gop=5) as (url, _), opened(url) as camera:
            assert tuple(camera.read().size) == (320, 240)
            assert (camera.read().pixels != camera.read().pixels).any()


def test_a_transport_stream_that_loses_packets_shows_whole_pictures_only():
    sent = packets_of(textured, 100, gop=10, form="mpegts")
    whole = {content(one) for one in shown(sent)}
    lottery = random.Random(4)
    pictures = shown([data for data in sent if lottery.random() > 0.02])
    assert len(pictures) > 10 and {content(one) for one in pictures} <= whole


def test_packets_are_lost_on_the_way_and_pictures_come_in_time():
    group, port = free_group()
    lottery = random.Random(5)
    relay = LossyRelay((group, port), lambda data: [data] if lottery.random() > 0.02 else [])
    with closing(relay), closing(H264Sender(relay.url)):
        begun = time.monotonic()
        with opened(f"rtp://{group}:{port}?interface=127.0.0.1") as camera:
            first_s = time.monotonic() - begun
            for _ in range(60):
                camera.read()
    assert first_s < 20  # 1 to 2 s on an idle machine: up to the next key frame


MUTATIONS = (
    lambda data, lottery: data[: lottery.randrange(len(data))],
    lambda data, lottery: bytes(
        b ^ (lottery.random() < 0.05) * lottery.randrange(256) for b in data[:200]
    ),
    lambda data, lottery: data[:1] + bytes([lottery.randrange(256)]) + data[2:],
    lambda data, lottery: data[:4] + lottery.randbytes(4) + data[8:],
    lambda data, lottery: data[:2] + lottery.randbytes(2) + data[4:],
    lambda data, lottery: data[:12] + bytes([28, lottery.choice((0x85, 0x45, 5, 0xC5))]),
    lambda data, lottery: data[:12] + bytes([24]) + lottery.randbytes(9),
    lambda data, lottery: bytes([lottery.randrange(256)]) + data[1:],
    lambda data, lottery: lottery.randbytes(lottery.randrange(1, 1500)),
)


@pytest.mark.parametrize("form", ["rtp", "mpegts", "h264"])
def test_mutated_packets_do_no_harm_and_the_next_key_frame_is_shown(form):
    sent = packets_of(carpet, 60, gop=10, form=form)
    packet = read_rtp(sent[0])
    stream, lottery = Stream(packet.kind if packet else None), random.Random(6)
    before_mb = resident_mb()
    for i in range(20_000):
        data = sent[i % len(sent)]
        if lottery.random() < 0.7:
            data = lottery.choice(MUTATIONS)(data, lottery)
        stream.push(data, read_rtp(data))
    assert resident_mb() - before_mb < 150
    pictures = [one for data in sent * 2 for one in stream.push(data, read_rtp(data))]
    assert any(one.key_frame for one in pictures)


def resident_mb() -> float:
    pages = Path("/proc/self/statm").read_text().split()[1]
    return int(pages) * resource.getpagesize() / 1e6


def test_bytes_in_which_no_picture_begins_are_not_collected():
    stream = Stream(None)
    stream.push(b"\0\0\0\1\x41" + bytes([0x55]) * 100, None)
    before_mb = resident_mb()
    for _ in range(60_000):
        stream.push(bytes([0x55]) * 1400, None)
    assert resident_mb() - before_mb < 40


def test_a_picture_without_end_takes_no_more_than_a_picture():
    order, pictures = ReorderBuffer(), H264Depacketiser()
    head = bytes.fromhex("8060")
    middle = bytes([28, 5]) + bytes(1300)
    for number in range(20_000):
        data = head + (number & 0xFFFF).to_bytes(2, "big") + bytes(8)
        data += middle if number else bytes([28, 0x85]) + bytes(1300)
        for packet, lost in order.push(read_rtp(data)):
            assert list(pictures.push(packet, lost)) == []
    assert len(pictures._unit) < 9_000_000


@pytest.mark.parametrize(
    "data",
    [
        b"",
        b"\x80",
        bytes(12),
        b"\x80\xc8" + bytes(26),
        b"\x40\x60" + bytes(30),
        b"\xbf\x60" + bytes(12),
    ],
    ids=["nothing", "a byte", "zeros", "RTCP", "version 1", "its head alone"],
)
def test_what_is_no_rtp_is_none(data):
    assert read_rtp(data) is None


def test_a_flood_of_junk_from_others_does_not_stop_the_pictures():
    with sent_to_group(gop=5) as (url, _), opened(url) as camera:
        group, _, port = url.partition("://")[2].partition("?")[0].partition(":")
        over, lottery = threading.Event(), random.Random(7)
        junk = [lottery.randbytes(300) for _ in range(50)]
        junk += [b"\x80\xc8" + bytes(40), b"\x80\x60" + bytes(6) + b"\x07" + bytes(40)]

        def flood():
            with closing(loopback_socket("127.0.0.9")) as line:
                while not over.wait(0.001):
                    line.sendto(lottery.choice(junk), (group, int(port)))

        thread = threading.Thread(target=flood)
        thread.start()
        try:
            for _ in range(30):
                assert tuple(camera.read().size) == (320, 240)
        finally:
            over.set()
            thread.join()


def tinted(colour: tuple[int, int, int]):
    return lambda n: np.where(carpet(n) == (60, 120, 40), np.uint8(colour), carpet(n)).astype(
        np.uint8
    )


def is_red(frame) -> bool:
    return bool(np.median(frame.pixels[:, :, 2]) > 100)


def test_one_of_two_senders_is_followed_until_it_is_silent_or_another_is_chosen():
    group, port = free_group()
    url = f"rtp://{group}:{port}?interface=127.0.0.1"
    second = LossyRelay((group, port), address="127.0.0.2")
    green = H264Sender(f"rtp://{group}:{port}?localaddr=127.0.0.1&ttl=0", gop=5)
    with closing(second), closing(green), opened(url) as camera:
        with closing(H264Sender(second.url, tinted((40, 40, 160)), gop=5)):
            until(lambda: camera.read() and len(camera.controls()[0].choices) == 2)
            assert not any(is_red(camera.read()) for _ in range(30))
            with opened(f"{url}&sender=127.0.0.2") as chosen:
                assert all(is_red(chosen.read()) for _ in range(10))
            with pytest.raises(BadInput, match=r"127\.0\.0\.7"):
                camera.set_control("sender", "127.0.0.7")
            assert camera.set_control("sender", "127.0.0.2").value == "127.0.0.2"
            assert all(is_red(camera.read()) for _ in range(10))
        until(lambda: _silent(camera))
        with opened(url) as again, closing(H264Sender(second.url, tinted((40, 40, 160)), gop=5)):
            assert not is_red(again.read())
            green.close()
            until(lambda: _read_red(again))


def _silent(camera) -> bool:
    try:
        camera.read()
    except Unavailable:
        return True
    return False


def _read_red(camera) -> bool:
    try:
        return is_red(camera.read())
    except Unavailable:
        return False


def test_a_sender_that_starts_anew_with_another_size_is_followed_at_once():
    with sent_to_group(gop=600) as (url, sender), opened(url) as camera:
        for size in ((160, 128), (320, 240), (640, 480)):
            sender.pictures = lambda n, size=size: carpet(n, *size)
            # there is one key frame of each size only: nothing of its start may be missed
            until(lambda size=size: tuple(camera.read().size) == size)


@pytest.mark.parametrize(
    ("url", "reason"),
    [
        ("rtp://camera.local:5004", "bad-source"),
        ("rtp://224.5.23.100", "bad-source"),
        ("rtp://224.5.23.100:0", "bad-source"),
        ("rtp://224.5.23.100:99999", "bad-source"),
        ("rtp://224.5.23.100:80", "bad-source"),
        ("udp://[::1]:5004", "bad-source"),
        ("rtp://224.5.23.100:5004/x", "bad-source"),
        ("rtp://224.5.23.100:5004?interface=no such", "bad-interface"),
        ("rtp://224.5.23.100:5004?interface=eth77", "no-interface"),
        ("rtp://224.5.23.100:5004?views=some", "bad-option"),
        ("rtp://0.0.0.0:5004?interface=lo", "bad-option"),
        ("rtp://203.0.113.7:5004", "network"),
    ],
)
def test_an_address_that_cannot_be_is_refused(url, reason):
    with pytest.raises(TouchlineError) as refused:
        source_from_url(url, AROUND)
    assert refused.value.reason == reason and refused.value.fix


def test_what_programs_of_this_machine_send_to_one_another_needs_the_settings_leave():
    port = free_port()
    with closing(H264Sender(f"rtp://127.0.0.1:{port}", gop=5)):
        with pytest.raises(BadInput) as refused:
            source_from_url(f"rtp://127.0.0.1:{port}", SourceContext())
        assert refused.value.reason == "forbidden-host"
        with pytest.raises(Unavailable, match="Nothing arrives"):
            source_from_url(f"rtp://0.0.0.0:{port}?open_s=0.5", SourceContext())
        with opened(f"rtp://@:{port}") as camera:
            assert tuple(camera.read().size) == (320, 240)
            with pytest.raises(Conflict) as taken:
                source_from_url(f"udp://127.0.0.1:{port}", AROUND)
            assert taken.value.reason == "network" and str(port) in taken.value.what


def test_why_there_is_no_picture_is_said():
    group, port = free_group()
    url = f"rtp://{group}:{port}?interface=127.0.0.1&open_s=0.5"
    cases = {
        "Nothing arrives": [],
        "no H.264": [b"\x80\x60" + bytes(10) + b"\xff junk", b"hello"],
        "No key frame": [data for data in packets_of(carpet, 20, gop=600)[6:] if not is_key(data)][
            :10
        ],
    }
    for words, packets in cases.items():
        over = threading.Event()

        def send(packets=packets, over=over):
            with closing(loopback_socket()) as line:
                while not over.wait(0.01):
                    for packet in packets:
                        line.sendto(packet, (group, port))

        thread = threading.Thread(target=send)
        thread.start()
        try:
            with pytest.raises(Unavailable, match=words) as refused:
                source_from_url(url, AROUND)
            assert refused.value.fix
        finally:
            over.set()
            thread.join()
