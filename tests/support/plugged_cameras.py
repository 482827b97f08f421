"""A made-up machine with cameras in its plugs, and a made-up camera: no real device can be had where tests run.

The folders are what Linux 6 shows for USB cameras; the camera behaves as V4L2 does under OpenCV, which hands on the
driver's own numbers.
"""

import time
from pathlib import Path

import cv2
import numpy as np


def plug_in(
    root: Path,
    number: int,
    *,
    plug: str = "1-2",
    name: str = "HD Webcam",
    serial: str = "A1B2C3",
    maker: str = "046d",
    product: str = "082d",
) -> None:
    """A USB camera, with its two nodes: one for pictures, one for metadata."""
    usb = root / f"sys/devices/pci0000:00/0000:00:14.0/usb1/{plug}"
    interface = usb / f"{plug}:1.0"
    interface.mkdir(parents=True, exist_ok=True)
    for file, text in (("idVendor", maker), ("idProduct", product), ("serial", serial)):
        if text:
            (usb / file).write_text(text + "\n")
    by_id = f"usb-{maker}_{name.replace(' ', '_')}" + f"_{serial}" * bool(serial)
    by_path = f"pci-0000:00:14.0-usb-0:{plug.partition('-')[2]}:1.0"
    for index in (0, 1):
        node = interface / f"video4linux/video{number + index}"
        node.mkdir(parents=True)
        (node / "name").write_text(f"{name}\n")
        (node / "index").write_text(f"{index}\n")
        (node / "device").symlink_to(interface)
        listed = root / "sys/class/video4linux"
        listed.mkdir(parents=True, exist_ok=True)
        (listed / node.name).symlink_to(node)
        device = root / "dev" / node.name
        device.parent.mkdir(parents=True, exist_ok=True)
        device.touch()
        for kind, lasting in (("by-id", by_id), ("by-path", by_path)):
            link = root / f"dev/v4l/{kind}/{lasting}-video-index{index}"
            link.parent.mkdir(parents=True, exist_ok=True)
            if not link.is_symlink():  # udev gives the first of two alike the name
                link.symlink_to(device)


class Webcam:
    """What cv2.VideoCapture is over V4L2; keeps to two sizes, two formats and whole rates, as cameras do."""

    def __init__(self) -> None:
        self.there, self.gone = True, False
        self.sets: list[tuple[int, float]] = []
        # a driver for which compressed pictures cannot be kept as they come
        self.always_decodes = False
        self.damaged = 0  # so many compressed pictures, from now on, have lost their end
        self.values = {
            cv2.CAP_PROP_FRAME_WIDTH: 640.0,
            cv2.CAP_PROP_FRAME_HEIGHT: 480.0,
            cv2.CAP_PROP_FPS: 30.0,
            cv2.CAP_PROP_EXPOSURE: 156.0,
            cv2.CAP_PROP_AUTO_EXPOSURE: 3.0,
            cv2.CAP_PROP_GAIN: 64.0,
            cv2.CAP_PROP_AUTO_WB: 1.0,
            cv2.CAP_PROP_WB_TEMPERATURE: 4600.0,
            cv2.CAP_PROP_CONVERT_RGB: 1.0,
            cv2.CAP_PROP_FOURCC: float(cv2.VideoWriter.fourcc(*"YUYV")),
        }
        self._due = time.monotonic()

    def isOpened(self) -> bool:
        return self.there

    def get(self, prop: int) -> float:
        return self.values.get(prop, -1.0)

    def set(self, prop: int, value: float) -> bool:
        self.sets.append((prop, value))
        if prop not in self.values:
            return False
        if prop in (cv2.CAP_PROP_EXPOSURE, cv2.CAP_PROP_WB_TEMPERATURE):
            mode, by_hand = (
                (cv2.CAP_PROP_AUTO_EXPOSURE, 1.0)
                if prop == cv2.CAP_PROP_EXPOSURE
                else (cv2.CAP_PROP_AUTO_WB, 0.0)
            )
            if self.values[mode] != by_hand:
                return False  # the driver refuses while the camera does it by itself
            low, high = (3, 2047) if prop == cv2.CAP_PROP_EXPOSURE else (2800, 6500)
            value = min(max(round(value), low), high)
        elif prop == cv2.CAP_PROP_AUTO_EXPOSURE and value not in (1, 3):
            return False
        elif prop == cv2.CAP_PROP_GAIN:
            value = min(max(round(value), 0), 255)
        elif prop == cv2.CAP_PROP_FRAME_WIDTH:
            value = 1280.0 if value >= 1280 else 640.0
            self.values[cv2.CAP_PROP_FRAME_HEIGHT] = 720.0 if value == 1280 else 480.0
        elif prop == cv2.CAP_PROP_FRAME_HEIGHT:
            return True  # goes by the width
        self.values[prop] = float(value)
        return True

    def read(self) -> tuple[bool, np.ndarray | None]:
        if self.gone:
            return False, None
        time.sleep(max(0.0, self._due - time.monotonic()))
        self._due = max(self._due + 1 / self.values[cv2.CAP_PROP_FPS], time.monotonic())
        size = (
            int(self.values[cv2.CAP_PROP_FRAME_HEIGHT]),
            int(self.values[cv2.CAP_PROP_FRAME_WIDTH]),
        )
        picture = np.full((*size, 3), 90, np.uint8)
        is_jpeg = self.values[cv2.CAP_PROP_FOURCC] == cv2.VideoWriter.fourcc(*"MJPG")
        if not is_jpeg or self.values[cv2.CAP_PROP_CONVERT_RGB] or self.always_decodes:
            return True, picture
        data = cv2.imencode(".jpg", picture)[1].tobytes()
        if self.damaged:
            self.damaged -= 1
            data = data[:-40]
        # a buffer is longer than what is in it
        return True, np.frombuffer(data + bytes(4000), np.uint8)[None]

    def release(self) -> None:
        self.there = False


V4L2_PATHS = (
    "/dev/../etc/passwd",
    "/dev/video0/../../etc/passwd",
    "/dev/v4l/by-id/../../../etc/passwd",
    "/dev/mem",
    "/dev/v4l/by-id/..",
    "../dev/video0",
    "/dev/video",
    "/dev/video9999",
    "-1",
    "0x0",
    "٣",
    "/dev/videox",
)
