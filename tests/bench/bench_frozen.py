"""How long do live pictures stay the same bit by bit, and what is said of them and of frozen ones under a clock?

    PYTHONPATH=.:tests python tests/bench/bench_frozen.py

A simulated camera over Division B, 640 × 512, 10 frames a second, looked at twice a second for 50 s; frozen ones stand
still from the 25th second on or from the first, a clock runs in a corner, and they are coded after that.
"""

from fractions import Fraction

import av
import cv2

from tests.support.live_cameras import FIELDS
from tests.support.simulated_source import simulated_source
from touchline.live.supervisor import ProcessStatus, frozen_doubt, frozen_reason
from touchline.vision.zones import Stillness

RIG = "sim://ssl-div-b?size=640x512&fps=240&noise={}&robots={}"
FPS, SECONDS, LOOK_S = 10, 50, 0.5


def taken(noise, robots, frozen_s=None):
    rendering, picture = simulated_source(RIG.format(noise, robots), FIELDS).rendering, None
    for number in range(FPS * SECONDS):
        if picture is None or frozen_s is None or number < frozen_s * FPS:
            picture = rendering.frame_at(number, number / FPS)
        shown = picture.copy()
        if frozen_s is not None:
            cv2.putText(
                shown,
                f"12:00:{number // FPS:02d}",
                (20, 40),
                cv2.FONT_HERSHEY_SIMPLEX,
                0.8,
                (255,) * 3,
                2,
            )
        yield shown


def jpegs(pictures, quality):
    for one in pictures:
        yield cv2.imdecode(
            cv2.imencode(".jpg", one, [cv2.IMWRITE_JPEG_QUALITY, quality])[1], cv2.IMREAD_COLOR
        )


def h264(pictures, crf, key_frame_s):
    coder, decoder = av.CodecContext.create("libx264", "w"), av.CodecContext.create("h264", "r")
    coder.width, coder.height, coder.pix_fmt, coder.time_base = (
        640,
        512,
        "yuv420p",
        Fraction(1, FPS),
    )
    coder.options = {"crf": str(crf), "preset": "veryfast", "tune": "zerolatency"}
    coder.gop_size = round(key_frame_s * FPS)
    for one in pictures:
        for packet in coder.encode(av.VideoFrame.from_ndarray(one, format="bgr24")):
            yield from (frame.to_ndarray(format="bgr24") for frame in decoder.decode(packet))


def judge(name, scheme, pictures):
    stillness, all_s, share, said = Stillness(), 0.0, 0.0, "live"
    for number, picture in enumerate(pictures):
        if number % round(LOOK_S * FPS):
            continue
        still = stillness.add(picture, number / FPS)
        status = ProcessStatus.initial(0.0).updated({"quality": {"still": still}}, 0.0)
        all_s, share = max(all_s, still["all_s"]), max(share, still["share"])
        found = (
            "stalled"
            if frozen_reason(status, scheme)
            else "in doubt"
            if frozen_doubt(status, scheme)
            else "live"
        )
        if found != "live" and said != "stalled":
            said = found
    print(
        f"{name}: the same at most {all_s:.1f} s as a whole, {100 * share:.0f} % of it for 20 s: {said}",
        flush=True,
    )


if __name__ == "__main__":
    for level in (2, 0.5):
        judge(f"raw, noise {level}", "v4l2", taken(level, 0))
        for q in (90, 50, 20):
            judge(f"JPEG {q}, noise {level}", "http", jpegs(taken(level, 0), q))
    for level in (2, 4):
        for strength in (23, 30, 37):
            for key_s in (2, 10, 100):
                judge(
                    f"H.264 crf {strength}, a key frame every {key_s} s, noise {level}",
                    "rtsp",
                    h264(taken(level, 0), strength, key_s),
                )
    judge(
        "H.264 crf 30, a key frame every 10 s, noise 2, 4 robots", "rtsp", h264(taken(2, 4), 30, 10)
    )
    for since_s in (25, 0):
        judge(f"frozen at {since_s} s, raw", "v4l2", taken(2, 4, since_s))
        judge(f"frozen at {since_s} s, JPEG 75", "http", jpegs(taken(2, 4, since_s), 75))
        for strength in (23, 30):
            for key_s in (2, 10):
                judge(
                    f"frozen at {since_s} s, H.264 crf {strength}, a key frame every {key_s} s",
                    "rtsp",
                    h264(taken(2, 4, since_s), strength, key_s),
                )
