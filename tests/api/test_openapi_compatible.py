"""The API's description still says all that it said: paths, parameters, bodies, answers, status codes and limits.

golden/openapi.json is `create_app(settings).openapi()` of version 0.1 without its version number. Entries may be added;
components may be renamed. A response may promise more than it did, a request may not ask for more. The names of the
calls, which generated clients have as functions, are those of golden/operation_ids.json.
"""

import copy
import json
from collections.abc import Iterator
from typing import Any

import pytest

from tests.support.paths import ROOT
from touchline.core.statements import STATEMENTS
from touchline.main import create_app
from touchline.settings import Settings

PROSE = {"title", "description", "summary", "operationId"}
LIMITS = {
    "required",
    "minimum",
    "maximum",
    "exclusiveMinimum",
    "exclusiveMaximum",
    "minLength",
    "maxLength",
    "pattern",
    "minItems",
    "maxItems",
    "minProperties",
    "maxProperties",
    "enum",
    "const",
    "additionalProperties",
}
CHANGED = (
    # Announced in the changelog: the part of the field that an image shows is recognised.
    "/calibrations/auto/post/requestBody/content/application/json/schema/properties/region/default: 'full' → 'auto'",
    # It is of OpenAPI 3.2, and made a document that says 3.1 invalid.
    "/jobs/{id}/events/get/responses/200/content/text/event-stream/itemSchema is gone",
    # Announced in the changelog: the pose from matches alone.
    "/pairs/post/responses/200/content/application/json/schema/required/pose is gone or changed",
    "/pairs/post/responses/200/content/application/json/schema/properties/pose is gone",
)


@pytest.fixture(scope="module")
def before() -> dict:
    return json.loads((ROOT / "tests" / "golden" / "openapi.json").read_text(encoding="utf-8"))


@pytest.fixture(scope="module")
def after(tmp_path_factory) -> dict:
    app = create_app(Settings(data=tmp_path_factory.mktemp("data")))
    with app.state.services.store:
        return app.openapi()


class Comparison:
    """Two documents, each with the components that its references name."""

    def __init__(self, before: dict, after: dict) -> None:
        self.documents = before, after

    def losses(self) -> list[str]:
        return list(self.of(*(document["paths"] for document in self.documents), "", prose=True))

    def of(self, old: Any, new: Any, at: str, prose: bool = False) -> Iterator[str]:
        """What `new` lacks of `old`. prose: titles are names here, as among paths and properties."""
        old, new = (self.resolved(*pair) for pair in zip(self.documents, (old, new), strict=True))
        if isinstance(old, dict) and isinstance(new, dict):
            is_response = "/responses/" in at
            for key in old.keys() - (set() if prose else PROSE):
                if (
                    key == "additionalProperties"
                    and old[key] is True
                    and (is_response or key not in new)
                ):
                    continue  # where nothing is said of them, they are allowed as well
                if key == "required" and key not in new and not is_response:
                    continue  # a request may ask for less
                if (
                    is_response
                    and key == "additionalProperties"
                    and new.get(key, True) is True
                    and "properties" in new
                ):
                    named = (
                        new["properties"].keys() - old.get("properties", {}).keys() - {STATEMENTS}
                    )
                    for name in named:  # what was any name
                        yield from self.of(old[key], new["properties"][name], f"{at}/{name}")
                # one of what it may have been
                elif is_response and key not in new and key == "anyOf":
                    if all(list(self.of(one, new, at)) for one in old[key]):
                        yield f"{at}/{key} is gone"
                elif key not in new:
                    yield f"{at}/{key} is gone"
                else:
                    yield from self.of(
                        old[key], new[key], f"{at}/{key}", prose=key in ("properties", "paths")
                    )
            if not prose and not is_response:
                yield from (f"{at}/{key} is new" for key in LIMITS & (new.keys() - old.keys()))
        elif isinstance(old, list) and isinstance(new, list):
            if at.endswith("/required") and "/responses/" not in at and len(old) != len(new):
                yield f"{at}: {old} → {new}"  # more is asked; a response may promise more
            for number, entry in enumerate(old):
                if not any(not list(self.of(entry, other, at)) for other in new):
                    name = entry.get("name", number) if isinstance(entry, dict) else entry
                    yield f"{at}/{name} is gone or changed"
        elif old != new or type(old) is not type(new):
            yield f"{at}: {old!r} → {new!r}"

    @staticmethod
    def resolved(document: dict, value: Any) -> Any:
        while isinstance(value, dict) and "$ref" in value:
            value = document["components"]["schemas"][value["$ref"].rpartition("/")[2]]
        return value


def test_the_description_loses_and_renames_nothing(before, after):
    assert [loss for loss in Comparison(before, after).losses() if not loss.endswith(CHANGED)] == []


def test_no_call_is_renamed(after):
    names = json.loads(
        (ROOT / "tests" / "golden" / "operation_ids.json").read_text(encoding="utf-8")
    )
    assert (
        names.items()
        - {
            f"{method.upper()} {path}": call["operationId"]
            for path, calls in after["paths"].items()
            for method, call in calls.items()
        }.items()
        == set()
    )


@pytest.mark.parametrize(
    "change",
    [
        lambda paths: paths.pop("/api/v1/lenses/{id}"),
        lambda paths: paths["/api/v1/lenses/{id}"].pop("delete"),
        lambda paths: paths["/api/v1/lenses"]["get"]["parameters"].pop(),
        lambda paths: paths["/api/v1/lenses"]["get"]["parameters"][0]["schema"].update(maximum=300),
        lambda paths: paths["/api/v1/rigs/{name}"]["put"]["responses"].pop("201"),
    ],
)
def test_a_loss_is_seen(before, change):
    after = copy.deepcopy(before)
    change(after["paths"])
    assert Comparison(before, after).losses()


@pytest.mark.parametrize(
    ("component", "change"),
    [
        ("FitRequest", lambda schema: schema["properties"].pop("note")),
        ("FitRequest", lambda schema: schema["required"].remove("field")),
        ("FitRequest", lambda schema: schema["required"].append("note")),
        ("FitRequest", lambda schema: schema["properties"]["observations"].update(minItems=1)),
        ("Snapshot", lambda schema: schema["properties"]["width"].update(type="number")),
        ("CameraStatus", lambda schema: schema["properties"]["state"]["enum"].remove("stalled")),
    ],
)
def test_a_loss_within_a_component_is_seen(before, component, change):
    after = copy.deepcopy(before)
    change(after["components"]["schemas"][component])
    assert Comparison(before, after).losses()
