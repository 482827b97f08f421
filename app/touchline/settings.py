"""Everything that can be set, read from one YAML file and the environment, which nothing else reads.

What is given to Settings() wins over TOUCHLINE_… (a double underscore steps into a section, as in
TOUCHLINE_SERVER__PORT), which wins over the file, which wins over the defaults here. A name that nobody
knows is an error, so a typing mistake is reported and not ignored.
"""

import os
from collections.abc import Iterable, Mapping
from dataclasses import asdict, dataclass
from math import inf
from pathlib import Path
from typing import Annotated, Any

import yaml
from pydantic import BaseModel, ConfigDict, Field, SecretStr, ValidationError, model_validator
from pydantic_settings import BaseSettings, InitSettingsSource, SettingsConfigDict
from pydantic_settings import PydanticBaseSettingsSource as Source

from touchline.core.errors import BadInput, NotFound
from touchline.core.json_values import JsonObject
from touchline.core.statements import say
from touchline.installation import shipped
from touchline.network.address import GROUP, PORT, MulticastAddress

Port = Annotated[int, Field(ge=0, le=65535)]
Count = Annotated[int, Field(ge=1)]
Seconds = Annotated[float, Field(gt=0, le=3600, allow_inf_nan=False)]
Megabytes = Annotated[float, Field(gt=0, le=4096, allow_inf_nan=False)]
Name = Annotated[str, Field(pattern=r"^[A-Za-z0-9][A-Za-z0-9_-]{0,63}$")]
FORM = "Write lines of the form name: value, as in configs/touchline.yaml."
REFEREE_GROUP, REFEREE_PORT = "224.5.23.1", 10003  # the league's usual ones
MIN_INTERVAL_S, MAX_INTERVAL_S = 0.1, 60.0  # between two packets of geometry
LOOPBACK = ("127.0.0.1", "localhost", "::1")


class _Section(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True)


class ServerSettings(_Section):
    host: str = "127.0.0.1"
    port: Port = 8000
    allowed_hosts: tuple[str, ...] = ()
    max_json_mb: Megabytes = 2.0
    max_connections: Count = 256
    max_connections_per_address: Count = 40
    request_timeout_s: Seconds = 10.0
    upload_timeout_s: Seconds = 30.0

    @property
    def is_loopback(self) -> bool:
        return self.host in LOOPBACK or self.host.startswith("127.")


class ImageSettings(_Section):
    max_file_mb: Megabytes = 32.0
    max_megapixels: Annotated[float, Field(gt=0, le=400)] = 50.0
    max_side_px: Annotated[int, Field(ge=16, le=65535)] = 16384
    decode_timeout_s: Seconds = 5.0


class SourceSettings(_Section):
    allowed_hosts: tuple[str, ...] = ()

    @model_validator(mode="before")
    @classmethod
    def _without_removed(cls, given: Any) -> Any:
        """Ignore what earlier versions had: their settings files still start a server."""
        return (
            {k: v for k, v in given.items() if k != "producers"}
            if isinstance(given, Mapping)
            else given
        )


class StorageSettings(_Section):
    uploads_mb: Annotated[float, Field(gt=0, le=10_000_000, allow_inf_nan=False)] = 2000.0
    backups_mb: Annotated[float, Field(gt=0, le=10_000_000, allow_inf_nan=False)] = 1000.0


class JobSettings(_Section):
    engine: Annotated[str, Field(pattern=r"^(local|dask(\+tls)?://[^/:\[\]]+:\d{1,5})$")] = "local"
    workers: Annotated[int, Field(ge=1, le=64)] = 2
    time_limit_s: Seconds = 600.0
    kept: Count = 100


class CameraSettings(_Section):
    id: Name
    name: str = ""
    source: str
    field: Name | None = None
    region: Name | None = None

    @property
    def title(self) -> str:
        return self.name or self.id


@dataclass(frozen=True)
class PublishSettings:
    """What the settings file says of geometry on the network.

    enabled: send geometry. absorb: listen to the group. broadcast: to all of the interface's network in place of the
    group. interval_s: between packets. limit_mm: a camera that
    teams would receive with a larger expected error is sent once that was approved. pass_on: send another publisher's
    field, ball models and cameras as they came. listen_first_s: how long to listen for others before the first packet,
    after publishing was switched on.
    """

    enabled: bool = False
    absorb: bool = False
    group: str = GROUP
    port: int = PORT
    interface: str = ""
    ttl: int = 1
    broadcast: bool = False
    interval_s: float = 3.0
    limit_mm: float = 30.0
    pass_on: bool = True
    listen_first_s: float = 4.0

    def __post_init__(self) -> None:
        _ = self.address  # which checks its parts
        for given_s, least_s in ((self.interval_s, MIN_INTERVAL_S), (self.listen_first_s, 0)):
            if not least_s <= given_s <= MAX_INTERVAL_S:
                raise BadInput(
                    say(
                        "publishing.bad-interval",
                        "{interval_s:g} s is not a valid interval.",
                        interval_s=given_s,
                    ),
                    say(
                        "publishing.interval-range",
                        "Give {least_s:g} to {most_s:g} seconds.",
                        least_s=least_s,
                        most_s=MAX_INTERVAL_S,
                    ),
                    reason="bad-interval",
                )
        if not 0 <= self.limit_mm < inf:
            raise BadInput(
                say("publishing.bad-limit", "The limit is not a valid length."),
                say("publishing.limit-range", "Give millimetres, 0 or more."),
                reason="bad-limit",
            )

    @property
    def address(self) -> MulticastAddress:
        return MulticastAddress(self.group, self.port, self.interface, self.ttl, self.broadcast)

    def to_json(self) -> JsonObject:
        return asdict(self)


class RefereeSettings(_Section):
    """What the settings file says of the game controller.

    enabled: listen to it; None: while geometry is published or listened to. interface: "" is that of publishing.
    """

    enabled: bool | None = None
    group: str = REFEREE_GROUP
    port: int = REFEREE_PORT
    interface: str = ""

    @model_validator(mode="after")
    def _has_an_address(self) -> "RefereeSettings":
        try:
            MulticastAddress(self.group, self.port, self.interface)
        except BadInput as error:
            raise ValueError(f"{error.what} {error.fix}") from None
        return self


class Settings(BaseSettings):
    """All settings, frozen: what create_app() and the commands work from."""

    model_config = SettingsConfigDict(
        env_prefix="TOUCHLINE_", env_nested_delimiter="__", extra="forbid", frozen=True
    )

    data: Path = Path("data")
    database: SecretStr | None = None
    fields: Path | None = None
    pictures: Path | None = None
    token: Annotated[SecretStr, Field(min_length=16)] | None = None
    server: ServerSettings = ServerSettings()
    images: ImageSettings = ImageSettings()
    sources: SourceSettings = SourceSettings()
    storage: StorageSettings = StorageSettings()
    jobs: JobSettings = JobSettings()
    publish: PublishSettings = PublishSettings()
    referee: RefereeSettings = RefereeSettings()
    cameras: tuple[CameraSettings, ...] = ()

    @model_validator(mode="after")
    def _each_camera_once(self) -> "Settings":
        ids = [camera.id for camera in self.cameras]
        if len(set(ids)) < len(ids):
            raise ValueError("two cameras have the same id")
        return self

    @property
    def own_fields(self) -> Path:
        """The folder of the operator's own field definitions."""
        return self.fields or self.data / "fields"

    @property
    def shown_pictures(self) -> Path:
        """The folder from which picture:// cameras read."""
        return self.pictures or self.data / "shown"


def read_yaml(path: Path) -> dict[str, Any]:
    """Read the file's mapping; an empty file is an empty mapping."""
    try:
        content = yaml.safe_load(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise NotFound(
            f"The settings file {path} cannot be read: {error.strerror}.",
            "Use --config with the path of a settings file.",
            reason="no-settings-file",
        ) from None
    except (yaml.YAMLError, UnicodeDecodeError) as error:
        place = getattr(error, "problem_mark", None)
        where = f" in line {place.line + 1}" if place else ""
        raise BadInput(
            f"The settings file {path} is not valid YAML{where}.", FORM, reason="bad-settings"
        ) from None
    if content is None:
        return {}
    if not isinstance(content, dict):
        raise BadInput(
            f"The settings file {path} contains no settings.", FORM, reason="bad-settings"
        )
    return {str(name): value for name, value in content.items()}


def unknown_variables(names: Iterable[str]) -> list[str]:
    """Return a warning for each environment variable that looks like a setting and is none.

    They are no errors: for a service called touchline, Kubernetes sets TOUCHLINE_PORT in every container.
    """
    sections = {
        section: field.annotation.model_fields
        for section, field in Settings.model_fields.items()
        if isinstance(field.annotation, type) and issubclass(field.annotation, BaseModel)
    }
    warnings = []
    for name in sorted(names):
        head, _, rest = name.upper().partition("_")
        first = rest.partition("__")[0].lower()
        if head != "TOUCHLINE" or not rest or first == "config" or first in Settings.model_fields:
            continue
        meant = [
            f"TOUCHLINE_{section}__{first}".upper()
            for section, fields in sections.items()
            if first in fields
        ]
        fix = (
            f"Use {' or '.join(meant)}." if meant else "configs/touchline.yaml lists all settings."
        )
        warnings.append(f"{name} is not a setting and has no effect. {fix}")
    return warnings


def load_settings(config: Path | None = None, **given: Any) -> Settings:
    """Settings from a file, the environment and what was given; BadInput names what is wrong.

    config: defaults to TOUCHLINE_CONFIG, then to the shipped touchline.yaml.
    """
    chosen = config or Path(
        os.environ.get("TOUCHLINE_CONFIG") or shipped("configs") / "touchline.yaml"
    )
    content = read_yaml(chosen)

    class FromFile(Settings):
        @classmethod
        def settings_customise_sources(
            cls,
            settings_cls: type[BaseSettings],
            init_settings: Source,
            env_settings: Source,
            dotenv_settings: Source,
            file_secret_settings: Source,
        ) -> tuple[Source, ...]:
            # Merged section by section, the first wins: one port in the environment leaves the file's host as it is.
            file = InitSettingsSource(settings_cls, {})
            file.init_kwargs = content  # given to it, a name in capitals would be known
            return init_settings, env_settings, file

    try:
        return FromFile(**{name: value for name, value in given.items() if value is not None})
    except (ValidationError, BadInput) as error:
        if isinstance(error, BadInput):  # of the network's settings, which know their own limits
            where, what = "publish", f"{error.what} {error.fix}"
        else:
            first = error.errors(include_url=False)[0]
            where, what = (
                ".".join(str(part) for part in first["loc"]) or "the settings",
                f"{first['msg']}.",
            )
        raise BadInput(
            f"Settings: {where}: {what[0].lower()}{what[1:]}",
            f"Correct it in {chosen}, in TOUCHLINE_… or on the command line.",
            reason="bad-settings",
        ) from None
