"""Network cameras in a process of their own: rendered pictures, compressed once, sent again and again.

    python -m tests.support.mjpeg_sender COUNT WIDTHxHEIGHT FPS

Prints one line of JSON: the cameras' addresses. Serves until its input ends.
"""

import json
import sys

import cv2

from tests.support.live_cameras import FIELDS
from tests.support.mjpeg_camera import MjpegCamera
from touchline.sources import SourceContext, source_from_url

PICTURES = 30
QUALITY = 85


def main() -> None:
    count, size, fps = int(sys.argv[1]), sys.argv[2], float(sys.argv[3])
    source = source_from_url(f"sim://table?size={size}&fps=240&robots=6", SourceContext(FIELDS))
    pictures = [
        cv2.imencode(".jpg", source.read().pixels, [cv2.IMWRITE_JPEG_QUALITY, QUALITY])[1].tobytes()
        for _ in range(PICTURES)
    ]
    source.close()
    cameras = [MjpegCamera(fps) for _ in range(count)]
    for camera in cameras:
        camera.parts = lambda n: [pictures[n % PICTURES]]
    print(
        json.dumps(
            {
                "urls": [camera.url for camera in cameras],
                "kb": sum(map(len, pictures)) / PICTURES / 1000,
            }
        ),
        flush=True,
    )
    sys.stdin.read()


if __name__ == "__main__":
    main()
