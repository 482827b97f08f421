"""One question about a film: how far the tracks of what rolls in it bow; every door asks the same one."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from app.errors import BadInput, Conflict, NotFound, Unavailable
from app.geometry import ImageSize
from app.images import frame_from_bytes
from app.models import Progress, model_from_json, no_progress
from app.motion_pipeline import Rolling
from app.sources import Surroundings
from app.sources.video import VideoSource

MOST_FRAMES = 100_000
SAY_EVERY = 10  # frames
OPTIONS = {"loop": False, "pace": "fast", "start_s": 0.0, "fps": None}


def rolls_in_film(path: Path, model: Mapping[str, Any] | None = None, progress: Progress = no_progress) \
        -> dict[str, Any]:
    """The report on a film. model: a calibration's {"id", "image_size", "name", "parameters"}, to judge as well.

    BadInput for what is no film, Conflict where the model is of pictures of another size.
    """
    film = _film(path)
    rolling, judged = Rolling(), None
    try:
        for number in range(MOST_FRAMES):
            try:
                frame = film.read()
            except Unavailable as error:
                if error.reason != "source-ended":
                    raise
                break
            if number == 0 and model is not None:
                judged = _model(model, frame.size)
            rolling.add(film.moment_s, frame.pixels)
            if number % SAY_EVERY == 0:
                progress(number / (number + 200), f"Following what moves: {film.moment_s:.1f} s, "
                                                  f"{len(rolling.runs)} rolls")
    finally:
        film.close()
    rolling.end()
    progress(1.0, "Done")
    return rolling.report(judged, None if model is None else model["id"])


def _film(path: Path) -> VideoSource:
    if not path.is_file():
        raise NotFound(f"There is no film {path.name!r}.", "Correct the path.", reason="unknown-video")
    return VideoSource.open(path.name, OPTIONS, Surroundings(decode=frame_from_bytes, pictures=path.parent))


def _model(told: Mapping[str, Any], size: ImageSize) -> Any:
    wanted = ImageSize.of(told["image_size"])
    if wanted != size:
        raise Conflict(f"The film is {size.width} × {size.height} px, the calibration is of pictures of {wanted.width} "
                       f"× {wanted.height} px.", "Use a film of the camera and mode that was calibrated.",
                       reason="size-mismatch")
    if not told["name"]:
        raise BadInput("The calibration has no model.", "Use another calibration.", reason="bad-calibration")
    return model_from_json(told["name"], told["parameters"])


def last_frame(path: Path) -> Any:
    """The pixels of a film's last frame."""
    film, pixels = _film(path), None
    try:
        while True:
            pixels = film.read().pixels
    except Unavailable as error:
        if error.reason != "source-ended":
            raise
    finally:
        film.close()
    return pixels
