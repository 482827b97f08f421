"""Untrusted bytes → Frame: a picture is screened by its header, then decoded in a process that may die.

    bytes ──screen──▶ Declared(format, width, height) ──child──▶ pixels of exactly that size ──▶ Frame

`screen.py` reads headers and never allocates what they ask for; a format is one file and one line in its
table (png, jpeg, bmp, webp). `decoder_worker.py` runs in a process of its own with little memory and no secrets;
`decoder.py` keeps a few of them warm and replaces the dead. Every refusal is a BadImage or an ImageTooLarge.

A server keeps one decoder for its life and calls it from its threads:

    with ImageDecoder() as decoder:
        frame = decoder.frame_from_bytes(data)

EXIF orientation is ignored on purpose: pixels stay as the sensor delivered them, because a calibration
belongs to the sensor and not to the way a viewer would like to hold the picture.
"""

from touchline.images.decoder import ImageDecoder, frame_from_bytes
from touchline.images.in_process import (
    ENCODED_MEDIA_TYPES,
    decode_in_process,
    encode,
    read_in_process,
)
from touchline.images.screen import DeclaredImage, ImageLimits, screen

__all__ = [
    "ENCODED_MEDIA_TYPES",
    "DeclaredImage",
    "ImageDecoder",
    "ImageLimits",
    "decode_in_process",
    "encode",
    "frame_from_bytes",
    "read_in_process",
    "screen",
]
