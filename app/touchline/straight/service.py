"""Saved rolls: the straight tracks that a ball has left before a camera; and what is made from them."""

from collections.abc import Iterable, Mapping, Sequence
from typing import Any, NotRequired

from pydantic import TypeAdapter
from sqlalchemy import delete, func, select
from typing_extensions import TypedDict

from touchline.core.errors import BadInput, Conflict
from touchline.core.json_values import JsonObject
from touchline.core.records import Calibration
from touchline.core.statements import say
from touchline.services.container import Services
from touchline.services.result_savers import save_new_version
from touchline.sources.files import file_within
from touchline.store.integrity import checksummed, content, json_text
from touchline.store.repository import Repository, check_etag, content_etag, timestamp
from touchline.store.tables import RollRow
from touchline.straight.rolling import check_product, check_refinable, stored_rolls_json
from touchline.straight.rolls import check_times

MAX_ROLLS = 300  # of one camera: with more nothing is known better; the oldest go
SAVED = ("at", "seconds", "points", "times", "rms_px", "straight_px")


class _Roll(TypedDict):
    id: str
    camera: str
    kept_at: str
    left_out: bool
    at: float
    seconds: float
    rms_px: float
    straight_px: float
    points: list[tuple[float, float]]
    image_size: tuple[int, int]
    times: NotRequired[list[float]]  # s, since the first point


ROLL = TypeAdapter(_Roll)


class RollRepository(Repository):
    """Rolls by camera. revision: another number after every change, by whomever."""

    table, noun = RollRow, "roll"
    listing = "List them with GET /api/v1/cameras/{id}/rolls."
    revision = 0

    def add(self, camera: str, id: str, roll: Mapping[str, Any]) -> bool:
        """Save one, plain JSON, under an id that its finder gave it; False where two have seen the same one."""
        saved = {
            **roll,
            "id": id,
            "camera": camera,
            "kept_at": timestamp(self._clock),
            "left_out": False,
        }
        with self._database.writing("The roll") as rows:
            if rows.scalar(select(RollRow.id).where(RollRow.id == id)) is not None:
                return False
            rows.add(checksummed(RollRow, saved, "The roll", id=id, camera=camera))
            rows.flush()
            mine = select(RollRow.sequence).where(RollRow.camera == camera)
            if (rows.scalar(select(func.count()).select_from(mine.subquery())) or 0) > MAX_ROLLS:
                oldest = mine.order_by(RollRow.sequence.desc()).offset(MAX_ROLLS)
                rows.execute(delete(RollRow).where(RollRow.sequence.in_(oldest)))
        self.revision += 1
        return True

    def of(self, camera: str) -> tuple[JsonObject, ...]:
        """Return a camera's, oldest first, without damaged ones."""
        query = (
            select(RollRow)
            .where(RollRow.camera == camera, RollRow.damaged.is_(None))
            .order_by(RollRow.sequence)
        )
        return self._intact(self._find(query), lambda row: content(self._checked(row)))

    def leave_out(
        self, camera: str, id: str, left_out: bool, etag: str | None = None
    ) -> JsonObject:
        """Save whether an operator wants the one with that ETag (None: whichever) left out; NotFound, or Stale."""
        with self._changing("The roll", id, RollRow.camera == camera) as (_, row):
            _check([content(row)], etag)
            saved = {**content(row), "left_out": left_out}
            row.body = json_text(saved, "The roll")
        self.revision += 1
        return saved

    def delete(self, camera: str, id: str, etag: str | None = None) -> None:
        """Delete the one with that ETag (None: whichever); NotFound, or Stale."""
        with self._changing("The deletion", id, RollRow.camera == camera) as (rows, row):
            _check([content(row)], etag)
            rows.delete(row)
        self.revision += 1

    def clear(self, camera: str, etag: str | None = None) -> None:
        """Delete all of a camera's; Stale unless all together have that ETag (None: whichever)."""
        with self._database.writing("The deletion") as rows:
            _check(self.of(camera) if etag is not None else (), etag)
            rows.execute(delete(RollRow).where(RollRow.camera == camera, RollRow.damaged.is_(None)))
        self.revision += 1


def _check(rolls: Sequence[Mapping[str, Any]], etag: str | None) -> None:
    now = [{"id": roll["id"], "left_out": roll["left_out"]} for roll in rolls]
    what = say("stale.rolls", "Another user has changed these rolls since you opened them.")
    check_etag(etag, _etag(rolls), what, "stale-rolls", now)


def _etag(rolls: Iterable[Mapping[str, Any]]) -> str:
    """Return the ETag of one roll or of several together: all else of a roll never changes."""
    return content_etag([[roll["id"], roll["left_out"]] for roll in rolls])


def read_roll(row: Any) -> object:
    """Read a saved row; raise where this version cannot."""
    roll = ROLL.validate_python(content(row))
    check_times(roll.get("times", []), roll["points"])
    return roll


def saved_rolls(services: Services) -> RollRepository:
    """Return the saved rolls of all cameras."""
    return services.store.repository(RollRepository)


def save_rolls(
    services: Services, camera: str, new: Iterable[Mapping[str, Any]], image_size: list[int]
) -> None:
    """Save rolls as the camera's process found them; the same one only once."""
    for roll in new:
        saved_rolls(services).add(
            camera, roll["id"], {**{name: roll[name] for name in SAVED}, "image_size": image_size}
        )


def rolls_json(services: Services, camera: str) -> JsonObject:
    """Return a camera's saved rolls with their figures and ETags, as the API shows them."""
    saved = saved_rolls(services).of(camera)
    shown = stored_rolls_json(saved, services.store.calibrations.active(camera))
    items = [
        {**item, "etag": _etag([roll])} for item, roll in zip(shown["items"], saved, strict=True)
    ]
    return {**shown, "items": items, "etag": _etag(saved)}


def motion_spec(
    services: Services,
    *,
    camera: str | None,
    film: str | None,
    rolls: list[JsonObject] | None,
    image_size: list[int] | None,
    calibration: str | None,
    make: str,
    lens: str,
    centre_sigma_px: float | None,
    note: str,
) -> JsonObject:
    """Return what rolling.run_motion takes; refuse at once what can be.

    One of camera (its saved rolls), film (its name in the pictures folder) and rolls, which need image_size.
    calibration: by default the camera's active one.
    """
    if sum(given is not None for given in (camera, film, rolls)) != 1:
        raise BadInput(
            "The request has no source for the rolls.",
            "Send one of camera, film and rolls.",
            reason="bad-request",
        )
    check_product(make, lens, centre_sigma_px)
    if camera is not None:
        services.cameras.get(camera)
        rolls, image_size = _counting_rolls(services, camera)
    elif film is not None:
        film = str(file_within(services.settings.shown_pictures, film, "video"))
    elif image_size is None:
        raise BadInput(
            "The request has no image size.",
            'Send "image_size": [width, height].',
            reason="no-image-size",
        )
    judged = _calibration_for(
        services, camera, calibration, image_size, is_needed=make == "refined"
    )
    if make == "refined":
        check_refinable(judged)
    return {
        "film": film,
        "rolls": rolls or [],
        "image_size": image_size,
        "make": make,
        "lens": lens,
        "calibration": None if judged is None else judged.to_json(),
        "note": note,
        "centre_sigma_px": centre_sigma_px,
        "camera": camera,
    }


def _counting_rolls(services: Services, camera: str) -> tuple[list[JsonObject], list[int]]:
    """Return a camera's rolls in images of the newest one's size, and that size; Conflict where all are left out."""
    saved = saved_rolls(services).of(camera)
    size = saved[-1]["image_size"] if saved else None
    rolls = [roll for roll in saved if roll["image_size"] == size and not roll["left_out"]]
    if not rolls:
        raise Conflict(
            say("rolls.none-saved", "This camera has no saved rolls."),
            say("rolls.start-recording", "Start the recording, then roll a ball across the field."),
            reason="no-rolls",
        )
    return rolls, saved[-1]["image_size"]


def _calibration_for(
    services: Services,
    camera: str | None,
    id: str | None,
    size: list[int] | None,
    *,
    is_needed: bool,
) -> Calibration | None:
    """Return the calibration with that id, else the camera's active one.

    Of images of another size than the rolls': Conflict where it was asked for, else None.
    """
    calibrations, found = services.store.calibrations, None
    if id is not None:
        found = calibrations.get(id)
    elif camera is not None:
        found = calibrations.active(camera)
    if found is None or size is None or [*found.image_size] == size:
        return found
    if id is not None or is_needed:
        raise Conflict(
            say(
                "rolls.not-of-calibration",
                "The rolls do not have the image size of the calibration, {size}.",
                size=found.image_size,
            ),
            say("rolls.same-camera", "Use rolls of the calibrated camera at the same resolution."),
            reason="size-mismatch",
        )
    return None


def save_motion(services: Services, result: JsonObject, about: JsonObject) -> JsonObject:
    """Save the version or the lens that rolls have given, if they have given one."""
    lens, version = result["lens"], None
    if result["calibration"] is not None:  # the version has its lens
        version = save_new_version(
            services.store, Calibration.from_json(result["calibration"]), about["by"]
        ).id
        lens = None
    record = services.store.lenses.add(lens) if lens else None
    return {"report": result["report"], "lens": record and record["id"], "calibration": version}
