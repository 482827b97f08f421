"""/health, /settings, /restore-backup, /archive and /docs: the server's state, its settings, all it has saved."""

import re
import time
from collections.abc import Iterator
from dataclasses import asdict
from functools import cache
from pathlib import Path
from typing import Any, Literal

from fastapi import APIRouter, Request
from pydantic import BaseModel, SecretStr
from starlette.responses import HTMLResponse, Response, StreamingResponse

from touchline.api import requests
from touchline.api.dependencies import ServicesDep
from touchline.api.middleware.access import has_token
from touchline.api.responses import NO_STORE, Json, attachment
from touchline.api.schemas import JsonObject, files, list_of, response
from touchline.core.errors import Unavailable
from touchline.core.statements import named, stated
from touchline.installation import __version__, shipped
from touchline.settings import PublishSettings, Settings
from touchline.store.opening import Restoration as RestorationRecord

START = "SwaggerUIBundle({url: '/api/v1/openapi.json', dom_id: '#swagger-ui', deepLinking: true});"
DOCS_PAGE = f"""<!doctype html><html lang="en"><head><meta charset="utf-8"><title>Touchline: REST</title>
<link rel="icon" href="/icon.svg">
<link rel="stylesheet" href="/vendor/swagger-ui/swagger-ui.css"></head><body><div id="swagger-ui"></div>
<script src="/vendor/swagger-ui/swagger-ui-bundle.js"></script><script>{START}</script></body></html>"""

# what can be changed while the server runs, and where
ELSEWHERE = {"cameras": "cameras", "publish": "network", "referee": "network"}
SECRET = "set"  # shown in place of a secret


def docs_router(static: Path) -> APIRouter:
    """Return the route of the page; it needs the browser libraries fetched when the package was built."""
    router = APIRouter(include_in_schema=False)

    @router.get("/docs")
    def docs() -> Response:
        if not (static / "vendor" / "swagger-ui" / "swagger-ui-bundle.js").is_file():
            raise Unavailable(
                "The files of the documentation page are missing.",
                "Install Touchline again with access to the npm registry, or use /api/v1/openapi.json.",
                reason="docs-not-built",
            )
        return HTMLResponse(DOCS_PAGE)

    return router


router = APIRouter()

Health = response(
    "Health",
    status=Literal["ok"],
    version=str,
    uptime_s=float,
    warnings=list[JsonObject],
    damaged=list[JsonObject],
)
Restoration = response("Restoration", record=RestorationRecord, lost=int)
SettingView = response(
    "SettingView", name=str, value=Any, default=Any, help=str, secret=bool, change=str | None
)
SettingsView = response("SettingsView", version=str, items=list_of(SettingView), storage=JsonObject)


@router.get("/health", tags=["health"], response_model=Health)
def read_health(services: ServicesDep, request: Request) -> Json:
    """Return version, uptime in s, warnings about disk and network, and damaged records.

    On a server with an access token, a request without it is answered with `status` alone.
    """
    token = services.settings.token
    if token is not None and not has_token(request.headers, token.get_secret_value()):
        return Json({"status": "ok"})
    warnings = (
        *services.store.warnings,
        *services.fields.warnings,
        *(warning for part in services.running_parts for warning in part.warnings),
    )
    return Json(
        {
            "status": "ok",
            "version": __version__,
            "uptime_s": round(time.monotonic() - services.started_s, 3),
            "warnings": [
                stated({"reason": w.reason, "text": w.text, "fix": w.fix}) for w in warnings
            ],
            "damaged": [damage.to_json() for damage in services.store.damaged],
        }
    )


@router.get("/settings", tags=["health"], response_model=SettingsView)
def read_settings(services: ServicesDep) -> Json:
    """List every setting with its default and meaning, without token and password; and how much of the disk is used."""
    helps = helps_in((shipped("configs") / "touchline.yaml").read_text(encoding="utf-8"))
    items = [
        stated(
            {
                "name": name,
                "value": _plain(value),
                "default": _plain(default),
                "help": named(f"setting.{name}", helps.get(name, "")),
                "secret": _is_secret(name),
                "change": ELSEWHERE.get(name.partition(".")[0]),
            }
        )
        for name, value, default in _all(services.settings)
    ]
    return Json({"version": __version__, "items": items, "storage": services.store.disk_usage})


def _all(settings: Settings) -> Iterator[tuple[str, Any, Any]]:
    """Yield (name, value, default) of each, in the file's order; a section's as section.name."""
    for name, field in Settings.model_fields.items():
        value, default = getattr(settings, name), field.default
        if isinstance(value, BaseModel | PublishSettings):
            for inner in vars(value):
                yield f"{name}.{inner}", getattr(value, inner), getattr(default, inner)
        elif name == "cameras":  # an address may contain a password; GET /cameras shows it without
            yield name, [camera.id for camera in value], []
        else:
            yield name, value, default


def _is_secret(name: str) -> bool:
    return name in Settings.model_fields and SecretStr.__name__ in str(
        Settings.model_fields[name].annotation
    )


def _plain(value: Any) -> Any:
    """Return a value as JSON; a secret never as itself."""
    if isinstance(value, SecretStr):
        return SECRET
    if isinstance(value, Path):
        return str(value)
    if isinstance(value, tuple | list):
        return [_plain(one) for one in value]
    return value


@cache
def helps_in(text: str) -> dict[str, str]:
    """Return what the shipped settings file says above each setting."""
    helps: dict[str, str] = {}
    comments: list[str] = []
    section = ""
    for line in text.splitlines():
        comment = re.match(r"\s*# ?(.*)", line)
        setting = re.match(r"( *)([a-z_]+):", line)
        if comment and not comment[1].startswith(" "):  # a deeper one is an example
            comments.append(comment[1].strip())
        elif setting:
            inside = bool(setting[1])
            section = section if inside else setting[2]
            helps[f"{section}.{setting[2]}" if inside else setting[2]] = " ".join(comments)
            comments = []
        elif not comment:
            comments = []
    return helps


@router.post("/restore-backup", tags=["archive"], response_model=Restoration)
async def restore_backup(services: ServicesDep, body: requests.RestoreBackup) -> Json:
    """Say which backup would replace the database and what would be lost; with those two numbers, replace it.

    The backup is the newest without a damaged row. The database from before is kept in `file`, in the quarantine.
    """
    if body.backup is None or body.database is None:
        found = await services.run_in_thread(services.store.find_restoration)
    else:
        found = await services.restore_backup((body.backup, body.database))
    return Json({**asdict(found), "lost": found.lost})


@router.get(
    "/archive",
    tags=["archive"],
    response_class=StreamingResponse,
    responses=files("application/zip"),
)
def download_archive(services: ServicesDep, passwords: bool = False) -> StreamingResponse:
    """Download one zip with every row, image and field of your own; `touchline restore` makes a data folder of it.

    It has no password of a camera, or with `?passwords=1` all of them, in clear.
    """
    return StreamingResponse(
        services.store.archive(services.settings.own_fields, passwords=passwords),
        media_type="application/zip",
        headers={"Content-Disposition": attachment("touchline.zip"), **NO_STORE},
    )
