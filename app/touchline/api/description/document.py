"""The OpenAPI document as generated clients need it: what each field means, examples, access, and files as bytes."""

from collections.abc import Iterator
from functools import cached_property
from typing import Any

from fastapi import FastAPI
from fastapi.routing import APIRoute

from touchline.api.dependencies import OPERATOR_HEADER
from touchline.api.description.examples import EXAMPLES, FORM
from touchline.api.description.fields import FIELDS
from touchline.api.description.own_fields import FORM_PARTS, ITEMS, OWN_FIELDS
from touchline.api.description.parameters import parameter_description
from touchline.api.middleware.access import COOKIE
from touchline.api.schemas.requests import Problem

Schema = dict[str, Any]
ACCESS: Schema = {
    "token": {"type": "http", "scheme": "bearer", "description": "The server's access token."},
    "cookie": {"type": "apiKey", "in": "cookie", "name": COOKIE,
               "description": "What a browser keeps after the login, in place of the token."},
}
NO_TOKEN: Schema = {}  # a server for its own machine alone has none
EVENTS = "text/event-stream"
METHODS = ("get", "put", "post", "patch", "delete")
OPERATOR: Schema = {"name": OPERATOR_HEADER, "in": "header", "required": False, "schema": {"type": "string"},
                    "description": "name of the operator, for what is saved, activated or started; by default the "
                                   "caller's network address"}


def operation_id(route: APIRoute) -> str:
    """Return the name of the route's function, which no path and no framework changes."""
    return route.name


class DescribedApi(FastAPI):
    """An application with a complete document, made once, when it is asked for."""

    @cached_property
    def _document(self) -> Schema:
        return completed(super().openapi())

    def openapi(self) -> Schema:
        return self._document


def completed(document: Schema) -> Schema:
    """Return the document, changed in place: valid 3.1, with meanings, examples and access.

    What nothing is known of, as of a route that was installed beside it, stays as it is.
    """
    schemas: dict[str, Schema] = document["components"]["schemas"]
    schemas[Problem.__name__] = Problem.model_json_schema()
    for path, method, operation in operations(document):
        if method != "get":
            operation.setdefault("parameters", []).append(dict(OPERATOR))
        for parameter in operation.get("parameters", ()):
            if "description" not in parameter and (meaning := parameter_description(path, parameter["name"])):
                parameter["description"] = meaning
        _complete_answers(operation["responses"])
        _complete_body(operation, schemas)
    own = own_fields()
    for name, schema in schemas.items():
        _describe_fields(schema, own.get(name, {}))
    document["components"]["securitySchemes"] = ACCESS
    document["security"] = [*({name: []} for name in ACCESS), NO_TOKEN]
    return document


def operations(document: Schema) -> Iterator[tuple[str, str, Schema]]:
    """Yield path, method and operation of every call."""
    for path, item in document["paths"].items():
        yield from ((path, method, item[method]) for method in METHODS if method in item)


def own_fields() -> dict[str, dict[str, str]]:
    """Return what fields mean in one component, by its name."""
    found: dict[str, dict[str, str]] = {name: {"items": items} for name, items in ITEMS.items()}
    for names, fields in OWN_FIELDS.items():
        for name in names.split():
            found.setdefault(name, {}).update(fields)
    return found


def _complete_answers(answers: Schema) -> None:
    for answer in answers.values():
        content = answer.get("content", {})
        if EVENTS in content:  # the framework's itemSchema is of OpenAPI 3.2
            content[EVENTS] = {"schema": {"description": "Events, each with a Job as its data."}}


def _complete_body(operation: Schema, schemas: dict[str, Schema]) -> None:
    """Give each body its example, and one of JSON its name: generators make a type of it."""
    for media_type, described in operation.get("requestBody", {}).get("content", {}).items():
        if example := EXAMPLES.get(operation["operationId"], {}).get(media_type):
            described["example"] = example
        schema = described["schema"]
        if media_type == FORM:
            _describe_fields(schema, FORM_PARTS)
        elif "properties" in schema:
            schemas[schema["title"]] = schema
            described["schema"] = {"$ref": f"#/components/schemas/{schema['title']}"}


def _describe_fields(schema: Schema, own: dict[str, str]) -> None:
    for field, described in schema.get("properties", {}).items():
        if "description" not in described and (meaning := own.get(field, FIELDS.get(field))):
            described["description"] = meaning
