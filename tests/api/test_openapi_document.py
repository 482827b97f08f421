"""The OpenAPI document: valid, each field and parameter described with its unit, an example that each body accepts."""

import json
import re
from collections.abc import Iterator
from typing import Any

import pytest
from openapi_spec_validator import OpenAPIV31SpecValidator
from starlette.testclient import TestClient

from touchline.api.description.document import (
    EXAMPLES,
    FORM,
    JSON,
    KINDS,
    NAMES,
    PARAMETERS,
    completed,
    operations,
    own_fields,
)
from touchline.api.description.fields import FIELDS
from touchline.api.description.own_fields import OWN_FIELDS
from touchline.formats import FORMATS
from touchline.main import create_app
from touchline.settings import Settings

UNITS = {
    "_mm": "mm",
    "_px": "px",
    "_deg": "degrees|°",
    "_s": r"\bs\b",
    "_ms": r"\bms\b",
    "_pct": "%",
    "_hz": "Hz",
}
MEASURED = re.compile(
    "|".join(
        (
            *UNITS.values(),
            "m²",
            "m/s²",
            "0 to 1",
            "0 to 255",
            "radians",
            "bytes",
            "σ",
            "in the units?",
            "of their units",
            "per second",
            "as a share of",
        )
    )
)
BARE_NUMBERS = {
    "options",
    "epipoles",
    "essential",
    "matrix",
    "degrees_of_freedom",
    "bands",
    "direction",
    "coefficients",
}


@pytest.fixture(scope="module")
def client(tmp_path_factory):
    with TestClient(
        create_app(Settings(data=tmp_path_factory.mktemp("data"))), base_url="http://127.0.0.1"
    ) as client:
        yield client


@pytest.fixture(scope="module")
def document(client) -> dict[str, Any]:
    return client.get("/api/v1/openapi.json").json()


def fields(document: dict[str, Any]) -> Iterator[tuple[str, str, dict[str, Any]]]:
    """Every field of every object, in components and in bodies: (name of the object, field, its schema)."""

    def within(value: Any, name: str) -> Iterator[tuple[str, str, dict[str, Any]]]:
        if isinstance(value, dict):
            if isinstance(value.get("properties"), dict):
                yield from (
                    (name, field, described) for field, described in value["properties"].items()
                )
            for key, inside in value.items():
                yield from within(inside, name if key in ("properties", "schema") else key)
        elif isinstance(value, list):
            for inside in value:
                yield from within(inside, name)

    yield from within(document["components"]["schemas"], "")
    yield from within(document["paths"], "")


def test_it_is_valid_openapi_3_1(document):
    assert document["openapi"].startswith("3.1.")
    assert [error.message for error in OpenAPIV31SpecValidator(document).iter_errors()] == []


def test_every_field_and_parameter_says_what_it_is(document):
    assert [
        f"{name}.{field}"
        for name, field, described in fields(document)
        if not described.get("description")
    ] == []
    assert [
        f"{path} {parameter['name']}"
        for path, _, operation in operations(document)
        for parameter in operation.get("parameters", ())
        if not parameter.get("description")
    ] == []


def test_every_length_and_every_number_has_its_unit(document):
    without = []
    for name, field, described in fields(document):
        said = described["description"]
        unit = next((unit for end, unit in UNITS.items() if field.endswith(end)), None)
        wanted = (
            unit
            if unit is not None
            else MEASURED
            if is_number(described) and field not in BARE_NUMBERS
            else ""
        )
        if not re.search(wanted, said):
            without.append(f"{name}.{field}: {said}")
    assert without == []


def is_number(schema: dict[str, Any]) -> bool:
    """Whether it is a number, or a list or table of numbers."""
    inside = [*schema.get("anyOf", ()), schema.get("items"), schema.get("additionalProperties")]
    return schema.get("type") == "number" or any(
        is_number(one) for one in inside if isinstance(one, dict)
    )


def test_nothing_is_described_that_is_not_there(document):
    own = own_fields()
    there = {(name, field) for name, field, _ in fields(document)}
    assert [
        (name, field)
        for name, known in own.items()
        for field in known
        if (name, field) not in there
    ] == []
    # of which only one would count
    assert [names for names, known in OWN_FIELDS.items() if "items" in known] == []
    shared = {
        field
        for name, field, described in fields(document)
        if described["description"] == FIELDS.get(field)
    }
    assert {*FIELDS} - shared == set()
    names = {
        parameter["name"].lower()
        for _, _, operation in operations(document)
        for parameter in operation.get("parameters", ())
    }
    assert {*PARAMETERS} - names == set() and "x-operator" in names
    assert {*KINDS, *NAMES} - {
        word for path, _, _ in operations(document) for word in path.split("/")
    } == set()


def test_what_a_route_of_another_says_itself_stays():
    document = completed(
        {
            "components": {
                "schemas": {
                    "Mine": {
                        "properties": {
                            "id": {"type": "string", "description": "its own"},
                            "quux": {"type": "string"},
                        }
                    }
                }
            },
            "paths": {
                "/mine": {
                    "get": {
                        "operationId": "mine",
                        "responses": {},
                        "parameters": [{"name": "quux"}],
                    }
                }
            },
        }
    )
    assert document["components"]["schemas"]["Mine"]["properties"] == {
        "id": {"type": "string", "description": "its own"},
        "quux": {"type": "string"},
    }


def test_every_operation_has_a_name_that_is_an_identifier(document):
    ids = [operation["operationId"] for _, _, operation in operations(document)]
    assert len(ids) == len({*ids}) > 100
    assert [id for id in ids if not re.fullmatch(r"[a-z]+(_[a-z]+)+", id)] == []


def test_every_body_has_an_example(document):
    bodies = {
        operation["operationId"]: operation["requestBody"]["content"]
        for _, _, operation in operations(document)
        if "requestBody" in operation
    }
    assert {*EXAMPLES} == {*bodies}
    assert [
        id
        for id, content in bodies.items()
        for media_type, described in content.items()
        if media_type in (JSON, FORM) and "example" not in described
    ] == []


@pytest.mark.parametrize("id", [id for id, bodies in EXAMPLES.items() if JSON in bodies])
def test_an_example_is_a_body_that_the_server_accepts(client, document, id):
    """Or refuses because there is nothing yet: no such image, no such camera."""
    path, method, operation = next(
        one for one in operations(document) if one[2]["operationId"] == id
    )
    example = operation["requestBody"]["content"][JSON]["example"]
    path = path.format_map(
        {
            "id": "none",
            "name": example.get("name", "none"),
            "snapshot": "none",
            "roll": "none",
            "format": "png",
        }
    )
    answer = client.request(method, path, json=example, headers={"If-Match": "none"})
    assert answer.status_code < 300 or answer.status_code in (404, 409, 412, 503), answer.text


def test_every_answer_says_what_its_content_is(document):
    for path, _, operation in operations(document):
        for status, answer in operation["responses"].items():
            for media_type, described in answer.get("content", {}).items():
                assert "schema" in described, (path, status, media_type)
                schema = described["schema"]
                if media_type.startswith(
                    ("image/", "application/octet", "application/zip", "multipart/")
                ):
                    assert schema == {
                        "type": "string",
                        "format": "binary",
                        "contentMediaType": media_type,
                    }
        problem = operation["responses"]["default"]["content"]["application/problem+json"]["schema"]
        assert problem == {"$ref": "#/components/schemas/Problem"}


def test_every_format_of_an_export_is_named(document):
    content = document["paths"]["/api/v1/calibrations/{id}/export/{format}"]["get"]["responses"][
        "200"
    ]["content"]
    assert {FORMATS[name].media_type for name in FORMATS} <= {*content}


def test_the_documented_access_opens_a_server_with_a_token(tmp_path, document):
    schemes = document["components"]["securitySchemes"]
    assert document["security"] == [*({name: []} for name in schemes), {}]
    app = create_app(Settings(data=tmp_path, token="a secret of the hall"))
    with TestClient(app, base_url="http://127.0.0.1") as client:
        asked = "/api/v1/cameras"
        assert client.get(asked).status_code == 401
        assert schemes["token"]["scheme"] == "bearer"
        assert (
            client.get(asked, headers={"Authorization": "Bearer a secret of the hall"}).status_code
            == 200
        )
        client.post(
            "/login", data={"token": "a secret of the hall"}, headers={"Origin": "http://127.0.0.1"}
        )
        assert schemes["cookie"]["name"] in client.cookies and client.get(asked).status_code == 200


def test_it_is_made_once(client):
    app = client.app
    assert app.openapi() is app.openapi() and json.dumps(app.openapi())
