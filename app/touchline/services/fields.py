"""What hangs on a field by its name: cameras, rigs, publishing and drafts."""

from typing import Any

from touchline.core.errors import Conflict
from touchline.core.field import Field
from touchline.core.statements import Sentence, say, stated
from touchline.services.container import Services
from touchline.settings import CameraSettings
from touchline.sources import split_address
from touchline.store.documents import Document
from touchline.store.snapshots import Draft

SHOWN_USERS = 3


def save_field(
    services: Services, name: str, value: dict[str, Any], etag: str | None, new: bool
) -> Field:
    """Check and save a field; whoever publishes or simulates it has it at once.

    Conflict where it lacks a region that a camera or a rig names.
    """
    with services.store.references:
        field = services.fields.put(
            name, value, etag, new, lambda changed: _refuse_lost_regions(services, changed)
        )
    for part in services.running_parts:
        part.wake()
    return field


def delete_field(services: Services, name: str, etag: str | None) -> None:
    """Delete one of the operator's own; Conflict while a camera, a rig or publishing names it."""
    with services.store.references:
        if services.fields.is_own(name) and (users := _users(services, name)):
            what = (
                say("field.in-use", "The field {name} is in use: {users}.", name=name, users=users)
                if len(users) <= SHOWN_USERS
                else say(
                    "field.in-use-by-many",
                    "The field {name} is in use: {users} and {more} more.",
                    name=name,
                    users=users[:SHOWN_USERS],
                    more=len(users) - SHOWN_USERS,
                )
            )
            raise Conflict(
                what,
                say(
                    "field.select-another",
                    "Select another field for each of them, then delete this field.",
                ),
                reason="field-used",
                users=users,
            )
        services.fields.delete(name, etag)


def simulated(services: Services, name: str) -> list[str]:
    """List the cameras whose picture the field itself makes."""
    return [
        camera.id
        for camera in services.cameras.all()
        if split_address(camera.source)[:2] == ("sim", name)
    ]


def _users(services: Services, name: str) -> list[str]:
    simulating = simulated(services, name)
    cameras = [
        _camera(camera)
        for camera in services.cameras.all()
        if camera.field == name or camera.id in simulating
    ]
    rigs = [_rig(rig) for rig in services.store.rigs.all() if rig.body["field"] == name]
    return [
        *cameras,
        *rigs,
        *(use for part in services.running_parts for use in part.uses_of_field(name)),
    ]


def _refuse_lost_regions(services: Services, changed: Field) -> None:
    """Raise Conflict for the first region that somebody names and that the field has no more."""
    naming = [
        (camera.region, _camera(camera))
        for camera in services.cameras.all()
        if camera.field == changed.name
    ]
    naming += [
        (camera["region"], _rig(rig))
        for rig in services.store.rigs.all()
        if rig.body["field"] == changed.name
        for camera in rig.body["cameras"]
    ]
    for region, user in naming:
        if region is not None and region not in changed.regions:
            raise Conflict(
                say(
                    "field.area-in-use",
                    "The covered area {area} of the field is in use: {user}.",
                    area=region,
                    user=user,
                ),
                say(
                    "field.select-another-area", "Select another area there, then remove this one."
                ),
                reason="region-used",
                entry="regions",
            )


def _camera(camera: CameraSettings) -> Sentence:
    return say("field.used-by-camera", "the camera {camera}", camera=camera.title)


def _rig(rig: Document) -> Sentence:
    return say("field.used-by-rig", "the rig {rig}", rig=rig.body["title"] or rig.name)


def with_known_field(services: Services, draft: Draft) -> dict[str, Any]:
    """Return a draft as the API shows it, with a notice in place of a field or region that is there no more."""
    shown = draft.to_json()
    name, region = shown["field"], shown["region"]
    if name is not None and name not in services.fields:
        notice = say(
            "draft.field-deleted",
            "The field {field} of this draft was deleted. Choose another field. The "
            "points are saved.",
            field=name,
        )
        return stated({"notice": notice, **shown, "field": None, "region": None, "rotate": None})
    if name is not None and region is not None and region not in services.fields[name].regions:
        notice = say(
            "draft.area-deleted",
            "The field {field} no longer has a covered area called {area}. Choose "
            "another. The points are saved.",
            field=name,
            area=region,
        )
        return stated({"notice": notice, **shown, "region": None, "rotate": None})
    return shown
