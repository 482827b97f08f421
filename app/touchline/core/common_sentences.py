"""Sentences that are said in several places: each is made here once, so that a code has one text."""

import re
import shlex
import sys
from collections.abc import Iterable
from importlib.util import find_spec

from touchline.core.geometry import ImageSize
from touchline.core.statements import Sentence, say
from touchline.core.text_format import sentence

NOT_CALIBRATED = say("camera.not-calibrated", "This camera has no active calibration.")
SENDS_NO_FRAMES = say("camera.sends-no-frames", "The camera sends no frames.")
SENDS_NO_IMAGES = say("camera.sends-no-images", "The camera no longer sends images.")
PROGRESS_DONE = say("progress.done", "Done")
DETECTING_FIELD_LINES = say("progress.field-lines", "Detecting the field lines")
DETECTING_LINES = say("progress.lines", "Detecting lines")
SHUTTING_DOWN = say("server.shutting-down", "The server is shutting down.")

ACTIVATE_OR_RAW = say("advice.activate-or-raw", "Activate a calibration, or use the raw view.")
CHECK_CABLE_AND_POWER = say("advice.check-cable-and-power", "Check its cable and its power.")
CALIBRATE_AGAIN_FOR_SIZE = say("advice.calibrate-again-for-size",
                               "Use an image of that size, or calibrate the camera again.")
CALIBRATE_AND_ACTIVATE = say("advice.calibrate-and-activate", "Calibrate the camera and activate the version.")
CALIBRATE_THIS_SIZE = say("advice.calibrate-this-size",
                          "Use an image of that size, or calibrate the camera at this size.")
CHECK_STATE_TRY_AGAIN = say("advice.check-state-try-again", "Check its state, then try again.")
FREE_MEMORY = say("advice.free-memory", "Free some memory, or reinstall Touchline.")
ONE_CAMERA = say("advice.one-camera", "Use images from one camera at one resolution.")
OPEN_AGAIN = say("advice.open-again", "Open it again.")
SECURE_CAMERA = say("advice.secure-camera", "Secure the camera, and switch off its automatic exposure.")
SET_RESOLUTION = say("advice.set-resolution", "Set the camera to that resolution, or calibrate it at this one.")
REPEAT = say("advice.repeat", "Try again.")
TRY_AGAIN = say("advice.try-again", "Try again in a moment.")
TRY_WHEN_BACK = say("advice.try-when-back", "Try again when it is back.")
TRIES_AGAIN = say("advice.tries-again", "Touchline tries again automatically. See the server log for the reason.")
SERIES_MOVED = say("series.moved", "The camera moved while the images were taken.")
SERIES_MOVED_FIX = say("series.moved.fix", "Fix the camera, then take the images again.")


def install_package(name: str) -> Sentence:
    """Return the command that installs an optional package into the environment in which this runs.

    One that was made as the README says has no pip of its own: the pip of another Python then installs into it.
    """
    pip = ("-m", "pip", "install") if find_spec("pip") else ("-m", "pip", "--python", sys.executable, "install")
    command = shlex.join(["python3" if "--python" in pip else sys.executable, *pip, name])
    return say("advice.install-package", "Run {command}, then start Touchline again.", command=command)


def use_one_of(names: Iterable[str]) -> Sentence:
    return say("advice.use-one-of", "Use one of: {names}.", names=list(names))


def camera_not_calibrated(title: str) -> Sentence:
    return say("rig.camera-not-calibrated", "{camera} has no active calibration.", camera=title)


def image_name(text: str) -> str:
    """Return a picture's name; one that we gave, "image 3" or "Image 3", as a sentence."""
    found = re.fullmatch(r"([Ii])mage (\d+)", text)
    if found is None:
        return text
    number = int(found[2])
    return (say("image.number", "Image {number}", number=number) if found[1] == "I"
            else say("image.number-within", "image {number}", number=number))


def unknown_field(name: str) -> Sentence:
    return say("field.unknown", "There is no field called {name!r}.", name=name)


def previous_images_differ(name: str, size: ImageSize, previous: ImageSize) -> Sentence:
    return say("image.differs-from-previous", "{image} is {size}, the previous images are {previous}.",
               image=image_name(sentence(name)), size=size, previous=previous)


def other_image_size(size: ImageSize, wanted: ImageSize) -> Sentence:
    return say("image.other-size", "The image is {size}; the calibration is for {wanted}.", size=size, wanted=wanted)
