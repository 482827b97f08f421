"""OpenCV's FFmpeg on a short leash: few protocols, few containers, deadlines, no words of its own.

FFmpeg would follow a playlist that calls itself a film to other files and machines; the lists below end that.
"""

import os

# OpenCV reads these when it opens something, and hands the first to FFmpeg: one text for files and RTSP alike, since an
# environment must not change while other threads look at it. A film in one of these containers names no other file.
os.environ["OPENCV_FFMPEG_CAPTURE_OPTIONS"] = (
    "protocol_whitelist;file,tcp,rtp|format_whitelist;mov,avi,matroska,rtsp,sdp|rtsp_transport;tcp"
    "|allowed_media_types;video|fpsprobesize;0")  # the last: no second of frames is looked at before the first is given
os.environ.setdefault("OPENCV_FFMPEG_LOGLEVEL", "-8")  # it would write addresses to stderr

import cv2

MAX_SIDE_PX = 16_384
MAX_PIXELS = 50_000_000


def open_capture(name: str, *, open_s: float = 2.0, read_s: float = 1.5, threads: int = 0) -> cv2.VideoCapture | None:
    """FFmpeg on a file's absolute path or an address of this machine; None where it does not open in time.

    A read then fails after read_s. threads: of the decoder, each a frame late; 0: as many as processors. Pixels come as
    they were coded, not turned.
    """
    capture = cv2.VideoCapture(name, cv2.CAP_FFMPEG, [
        cv2.CAP_PROP_OPEN_TIMEOUT_MSEC, round(open_s * 1000), cv2.CAP_PROP_READ_TIMEOUT_MSEC, round(read_s * 1000),
        cv2.CAP_PROP_N_THREADS, threads])
    width, height = capture.get(cv2.CAP_PROP_FRAME_WIDTH), capture.get(cv2.CAP_PROP_FRAME_HEIGHT)
    if not capture.isOpened() or max(width, height) > MAX_SIDE_PX or width * height > MAX_PIXELS:
        capture.release()
        return None
    capture.set(cv2.CAP_PROP_ORIENTATION_AUTO, 0)
    return capture
