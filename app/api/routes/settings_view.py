"""GET /settings: what the server runs with, said without any secret; and what of the disk is taken."""

import re
from collections.abc import Iterator
from functools import cache
from pathlib import Path
from typing import Any

from fastapi import APIRouter, Request
from pydantic import BaseModel, SecretStr

from app import __version__, shipped
from app.api.answers import Json
from app.api.schemas.responses.base import Answer
from app.settings import Settings

router = APIRouter(tags=["health"])

ELSEWHERE = {"cameras": "cameras", "publish": "network"}  # what can be changed while the server runs, and where
SET = "set"  # all that is ever said of a secret


class Setting(Answer):
    """value: as it is now, "set" or null of a secret. change: null where only the settings file decides it."""

    name: str
    value: Any
    default: Any
    help: str
    secret: bool
    change: str | None


class SettingsTold(Answer):
    version: str
    items: list[Setting]
    storage: dict[str, Any]


@router.get("/settings", response_model=SettingsTold)
def read_settings(request: Request) -> Json:
    """Every setting with its default and what it means; no token, no password. And what of the disk is taken."""
    settings: Settings = request.app.state.settings
    helps = helps_in((shipped("configs") / "touchline.yaml").read_text(encoding="utf-8"))
    items = [{"name": name, "value": _plain(value), "default": _plain(default), "help": helps.get(name, ""),
              "secret": _is_secret(name), "change": ELSEWHERE.get(name.partition(".")[0])}
             for name, value, default in _all(settings)]
    return Json({"version": __version__, "items": items, "storage": request.app.state.store.disk_usage.to_json()})


def _all(settings: Settings) -> Iterator[tuple[str, Any, Any]]:
    """(name, value, default) of each, in the file's order; a section's as section.name."""
    for name, field in Settings.model_fields.items():
        value, default = getattr(settings, name), field.default
        if isinstance(value, BaseModel):
            for inner in type(value).model_fields:
                yield f"{name}.{inner}", getattr(value, inner), getattr(default, inner)
        elif name == "cameras":  # an address may carry a password; GET /cameras tells it without
            yield name, [camera.id for camera in value], []
        else:
            yield name, value, default


def _is_secret(name: str) -> bool:
    return name in Settings.model_fields and SecretStr.__name__ in str(Settings.model_fields[name].annotation)


def _plain(value: Any) -> Any:
    """As JSON; a secret never as itself."""
    if isinstance(value, SecretStr):
        return SET
    if isinstance(value, Path):
        return str(value)
    if isinstance(value, tuple | list):
        return [_plain(one) for one in value]
    return value


@cache
def helps_in(text: str) -> dict[str, str]:
    """What the shipped settings file says above each setting."""
    helps: dict[str, str] = {}
    said: list[str] = []
    section = ""
    for line in text.splitlines():
        comment = re.match(r"\s*# ?(.*)", line)
        setting = re.match(r"( *)([a-z_]+):", line)
        if comment and not comment[1].startswith(" "):  # a deeper one is an example
            said.append(comment[1].strip())
        elif setting:
            inside = bool(setting[1])
            section = section if inside else setting[2]
            helps[f"{section}.{setting[2]}" if inside else setting[2]] = " ".join(said)
            said = []
        elif not comment:
            said = []
    return helps
