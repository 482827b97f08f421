"""Sentences that are stated in several places, and what borders, markings and areas of fields are called in them.

Names of markings and areas stand in lower case and without article. The page's catalogues have the same,
static/core/words/en/markings.js and areas.js. Fields of operators have names of their own, which are read as they are
written: "my-line", "my line".
"""

import re
import shlex
import sys
from collections.abc import Iterable, Sequence
from importlib.util import find_spec

from touchline.core.geometry import ImageSize
from touchline.core.statements import Sentence, say, sentence

MARKINGS = {
    "left": "left border",
    "right": "right border",
    "top": "top border",
    "bottom": "bottom border",
    "touch-line": "touch line",
    "goal-line": "goal line",
    "touch-line-top": "top touch line",
    "touch-line-bottom": "bottom touch line",
    "goal-line-left": "left goal line",
    "goal-line-left-middle": "middle of the left goal line",
    "goal-line-right": "right goal line",
    "goal-line-right-middle": "middle of the right goal line",
    "halfway-line": "halfway line",
    "centre-line": "centre line",
    "halfway-top": "top end of the halfway line",
    "halfway-bottom": "bottom end of the halfway line",
    "centre": "field centre",
    "centre-circle": "centre circle",
    "circle-top": "top point of the centre circle",
    "circle-bottom": "bottom point of the centre circle",
    "circle-left": "left point of the centre circle",
    "circle-right": "right point of the centre circle",
    "goal-left-post-top": "top post of the left goal",
    "goal-left-post-bottom": "bottom post of the left goal",
    "penalty-mark-left": "left penalty mark",
    "goal-right-post-top": "top post of the right goal",
    "goal-right-post-bottom": "bottom post of the right goal",
    "penalty-mark-right": "right penalty mark",
    "defence-left-front": "front line of the left defence area",
    "defence-left-top": "top line of the left defence area",
    "defence-left-bottom": "bottom line of the left defence area",
    "defence-left-corner-top": "top front corner of the left defence area",
    "defence-left-foot-top": "top rear corner of the left defence area",
    "defence-left-corner-bottom": "bottom front corner of the left defence area",
    "defence-left-foot-bottom": "bottom rear corner of the left defence area",
    "defence-left-middle": "front middle of the left defence area",
    "defence-left-arc-top": "top arc of the left defence area",
    "defence-left-arc-bottom": "bottom arc of the left defence area",
    "defence-right-front": "front line of the right defence area",
    "defence-right-top": "top line of the right defence area",
    "defence-right-bottom": "bottom line of the right defence area",
    "defence-right-corner-top": "top front corner of the right defence area",
    "defence-right-foot-top": "top rear corner of the right defence area",
    "defence-right-corner-bottom": "bottom front corner of the right defence area",
    "defence-right-foot-bottom": "bottom rear corner of the right defence area",
    "defence-right-middle": "front middle of the right defence area",
    "defence-right-arc-top": "top arc of the right defence area",
    "defence-right-arc-bottom": "bottom arc of the right defence area",
    "goal-area-left-front": "front line of the left goal area",
    "goal-area-left-top": "top line of the left goal area",
    "goal-area-left-bottom": "bottom line of the left goal area",
    "goal-area-left-corner-top": "top front corner of the left goal area",
    "goal-area-left-foot-top": "top rear corner of the left goal area",
    "goal-area-left-corner-bottom": "bottom front corner of the left goal area",
    "goal-area-left-foot-bottom": "bottom rear corner of the left goal area",
    "goal-area-left-arc": "arc of the left goal area",
    "goal-area-left-arc-top": "top end of the left goal area arc",
    "goal-area-left-arc-bottom": "bottom end of the left goal area arc",
    "goal-area-right-front": "front line of the right goal area",
    "goal-area-right-top": "top line of the right goal area",
    "goal-area-right-bottom": "bottom line of the right goal area",
    "goal-area-right-corner-top": "top front corner of the right goal area",
    "goal-area-right-foot-top": "top rear corner of the right goal area",
    "goal-area-right-corner-bottom": "bottom front corner of the right goal area",
    "goal-area-right-foot-bottom": "bottom rear corner of the right goal area",
    "goal-area-right-arc": "arc of the right goal area",
    "goal-area-right-arc-top": "top end of the right goal area arc",
    "goal-area-right-arc-bottom": "bottom end of the right goal area arc",
    "corner-top-left": "top left corner",
    "cut-top-left-touch": "top left corner cut at the touch line",
    "cut-top-left-goal": "top left corner cut at the goal line",
    "cross-top-left": "top left cross",
    "corner-top-right": "top right corner",
    "cut-top-right-touch": "top right corner cut at the touch line",
    "cut-top-right-goal": "top right corner cut at the goal line",
    "cross-top-right": "top right cross",
    "corner-bottom-left": "bottom left corner",
    "cut-bottom-left-touch": "bottom left corner cut at the touch line",
    "cut-bottom-left-goal": "bottom left corner cut at the goal line",
    "cross-bottom-left": "bottom left cross",
    "corner-bottom-right": "bottom right corner",
    "cut-bottom-right-touch": "bottom right corner cut at the touch line",
    "cut-bottom-right-goal": "bottom right corner cut at the goal line",
    "cross-bottom-right": "bottom right cross",
    "cross-left": "left cross",
    "cross-right": "right cross",
}

AREAS = {
    "full": "full field",
    "half": "half, goal line on top",
    "half-left": "left half",
    "half-right": "right half",
    "quarter-top-left": "top left quarter",
    "quarter-top-right": "top right quarter",
    "quarter-bottom-left": "bottom left quarter",
    "quarter-bottom-right": "bottom right quarter",
    "eighth-0": "outer bottom left eighth",
    "eighth-1": "outer top left eighth",
    "eighth-2": "inner bottom left eighth",
    "eighth-3": "inner top left eighth",
    "eighth-4": "inner bottom right eighth",
    "eighth-5": "inner top right eighth",
    "eighth-6": "outer bottom right eighth",
    "eighth-7": "outer top right eighth",
}

NOT_CALIBRATED = say("camera.not-calibrated", "This camera has no active calibration.")
SENDS_NO_FRAMES = say("camera.sends-no-frames", "The camera sends no frames.")
SENDS_NO_IMAGES = say("camera.sends-no-images", "The camera no longer sends images.")
PROGRESS_DONE = say("progress.done", "Done")
DETECTING_FIELD_LINES = say("progress.field-lines", "Detecting the field lines")
DETECTING_LINES = say("progress.lines", "Detecting lines")
SHUTTING_DOWN = say("server.shutting-down", "The server is shutting down.")

ACTIVATE_OR_RAW = say("advice.activate-or-raw", "Activate a calibration, or use the raw view.")
CHECK_CABLE_AND_POWER = say("advice.check-cable-and-power", "Check its cable and its power.")
CALIBRATE_AGAIN_FOR_SIZE = say(
    "advice.calibrate-again-for-size", "Use an image of that size, or calibrate the camera again."
)
CALIBRATE_AND_ACTIVATE = say(
    "advice.calibrate-and-activate", "Calibrate the camera and activate the version."
)
CALIBRATE_THIS_SIZE = say(
    "advice.calibrate-this-size", "Use an image of that size, or calibrate the camera at this size."
)
CHECK_STATE_TRY_AGAIN = say("advice.check-state-try-again", "Check its state, then try again.")
FREE_MEMORY = say("advice.free-memory", "Free some memory, or reinstall Touchline.")
ONE_CAMERA = say("advice.one-camera", "Use images from one camera at one resolution.")
OPEN_AGAIN = say("advice.open-again", "Open it again.")
SECURE_CAMERA = say(
    "advice.secure-camera", "Secure the camera, and switch off its automatic exposure."
)
SET_RESOLUTION = say(
    "advice.set-resolution", "Set the camera to that resolution, or calibrate it at this one."
)
REPEAT = say("advice.repeat", "Try again.")
TRY_AGAIN = say("advice.try-again", "Try again in a moment.")
TRY_WHEN_BACK = say("advice.try-when-back", "Try again when it is back.")
TRIES_AGAIN = say(
    "advice.tries-again", "Touchline tries again automatically. See the server log for the reason."
)
SERIES_MOVED = say("series.moved", "The camera moved while the images were taken.")
SERIES_MOVED_FIX = say("series.moved.fix", "Fix the camera, then take the images again.")


def marking_name(id: str) -> Sentence:
    """Return the name of a border, line, arc or landmark, stated as "line.touch-line-top"; another's as plain text."""
    return _name(id, MARKINGS, "line")


def area_name(id: str) -> Sentence:
    """Return the name of an area, stated as "area.half-left"; another's as plain text."""
    return _name(id, AREAS, "area")


def marking_names(ids: Sequence[str]) -> list[Sentence]:
    return [marking_name(id) for id in ids]


def _name(id: str, table: dict[str, str], part: str) -> Sentence:
    return (
        say(f"{part}.{id}", table[id])
        if id in table
        else Sentence(id.replace("-", " ").replace("_", " "))
    )


def the_border(id: str | None) -> Sentence:
    """Return "the left border", with its name as what it states; "the border" where it has no id."""
    called = marking_name(id) if id else Sentence("border")
    return Sentence(f"the {called}", called.statements)


def install_package(name: str) -> Sentence:
    """Return the command that installs an optional package into the environment in which this runs.

    One that was made as the README says has no pip of its own: the pip of another Python then installs into it.
    """
    pip = (
        ("-m", "pip", "install")
        if find_spec("pip")
        else ("-m", "pip", "--python", sys.executable, "install")
    )
    command = shlex.join(["python3" if "--python" in pip else sys.executable, *pip, name])
    return say(
        "advice.install-package", "Run {command}, then start Touchline again.", command=command
    )


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
    return (
        say("image.number", "Image {number}", number=number)
        if found[1] == "I"
        else say("image.number-within", "image {number}", number=number)
    )


def unknown_field(name: str) -> Sentence:
    return say("field.unknown", "There is no field called {name!r}.", name=name)


def previous_images_differ(name: str, size: ImageSize, previous: ImageSize) -> Sentence:
    return say(
        "image.differs-from-previous",
        "{image} is {size}, the previous images are {previous}.",
        image=image_name(sentence(name)),
        size=size,
        previous=previous,
    )


def other_image_size(size: ImageSize, wanted: ImageSize) -> Sentence:
    return say(
        "image.other-size",
        "The image is {size}; the calibration is for {wanted}.",
        size=size,
        wanted=wanted,
    )
