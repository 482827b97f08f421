"""A real RTSP camera for tests: GStreamer's server from Debian's packages, in the system's own Python.

Needs gir1.2-gst-rtsp-server-1.0, gstreamer1.0-plugins-{base,good,bad,ugly} and python3-gi (.ci/run installs them).
Lines on its standard input change the size of the running stream: 640x480.
"""

import shutil
import subprocess
import sys
from pathlib import Path

ENCODERS = {
    "h264": "x264enc tune=zerolatency speed-preset=ultrafast key-int-max={gop} ! rtph264pay config-interval=-1",
    "h265": "x265enc tune=zerolatency speed-preset=ultrafast key-int-max={gop} ! rtph265pay config-interval=-1",
    "mjpeg": "jpegenc ! rtpjpegpay",
    "vp8": "vp8enc deadline=1 keyframe-max-dist={gop} ! rtpvp8pay",
}
PYTHON = "/usr/bin/python3"


class GstCamera:
    """Starts one with the codec and waits until it serves; .url is where."""

    def __init__(self, codec: str, gop: int = 25) -> None:
        self._process = subprocess.Popen(
            [PYTHON, __file__, codec, str(gop)],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
        )
        assert self._process.stdin is not None and self._process.stdout is not None
        self._orders, self._answers = self._process.stdin, self._process.stdout
        port = self._answers.readline().strip()
        if not port:
            raise RuntimeError(
                "GStreamer's RTSP server does not start; install what tests/support/gst_camera.py names"
            )
        self.url = f"rtsp://127.0.0.1:{port}/cam"

    def resize(self, width: int, height: int) -> None:
        self._orders.write(f"{width}x{height}\n")
        self._orders.flush()

    def close(self) -> None:
        self._process.kill()
        self._process.wait()
        self._orders.close()
        self._answers.close()


def installed() -> bool:
    """Whether the packages are here."""
    ask = "import gi; gi.require_version('GstRtspServer', '1.0'); from gi.repository import GstRtspServer"
    return (
        bool(shutil.which(PYTHON))
        and Path(PYTHON).exists()
        and subprocess.run([PYTHON, "-c", ask], capture_output=True).returncode == 0
    )


def main(codec: str, gop: str) -> None:
    import gi

    gi.require_version("Gst", "1.0")
    gi.require_version("GstRtspServer", "1.0")
    from gi.repository import GLib, Gst, GstRtspServer

    Gst.init(None)
    server = GstRtspServer.RTSPServer()
    server.set_address("127.0.0.1")
    server.set_service("0")
    factory = GstRtspServer.RTSPMediaFactory()
    factory.set_launch(
        "( videotestsrc is-live=true pattern=smpte ! videoscale ! "
        "capsfilter name=size caps=video/x-raw,format=I420,width=320,height=240,framerate=25/1 ! "
        + ENCODERS[codec].format(gop=gop)
        + " name=pay0 pt=96 )"
    )
    factory.set_shared(True)
    now: list[Gst.Caps] = []
    filters: list[Gst.Element] = []

    def made(_factory, media) -> None:
        filters.append(media.get_element().get_by_name("size"))
        if now:
            filters[-1].set_property("caps", now[-1])

    factory.connect("media-configure", made)
    server.get_mount_points().add_factory("/cam", factory)
    server.attach(None)
    print(server.get_bound_port(), flush=True)

    def told(channel, _condition) -> bool:
        width, height = channel.readline().split("x")
        now.append(
            Gst.Caps.from_string(
                f"video/x-raw,format=I420,width={width},height={int(height)},framerate=25/1"
            )
        )
        for one in filters:
            one.set_property("caps", now[-1])
        return True

    GLib.io_add_watch(sys.stdin, GLib.PRIORITY_DEFAULT, GLib.IO_IN, told)
    GLib.MainLoop().run()


if __name__ == "__main__":
    main(*sys.argv[1:])
