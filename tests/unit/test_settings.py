"""Settings: the shipped file is the defaults, a typing mistake is told, the environment wins over the file."""

import os
import re
from itertools import pairwise

import pytest
import yaml

from touchline.api.server import with_token
from touchline.core.errors import BadInput, NotFound
from touchline.installation import shipped
from touchline.settings import Settings, load_settings, unknown_variables

FILE = shipped("configs") / "touchline.yaml"


@pytest.fixture(autouse=True)
def no_settings_around(monkeypatch):
    for name in list(os.environ):
        if name.startswith("TOUCHLINE_"):
            monkeypatch.delenv(name)


def written(tmp_path, text):
    path = tmp_path / "touchline.yaml"
    path.write_text(text)
    return path


def test_the_shipped_file_holds_every_setting_with_its_default():
    assert yaml.safe_load(FILE.read_text()) == Settings().model_dump(mode="json") | {"cameras": []}


def test_every_setting_in_the_shipped_file_has_a_comment_above_it():
    lines = FILE.read_text().splitlines()
    for above, line in pairwise(lines):
        section = line.strip() in (
            "server:",
            "images:",
            "sources:",
            "jobs:",
            "storage:",
            "publish:",
        )
        if re.match(r" *[a-z_]+:", line) and not section:
            assert above.strip().startswith("#"), line


def test_the_example_camera_of_the_shipped_file_is_one(tmp_path):
    text = FILE.read_text().split("such as\n")[1]
    example = "cameras:\n" + "\n".join(
        line.removeprefix("#") for line in text.splitlines() if line.startswith("#   ")
    )
    (camera,) = load_settings(written(tmp_path, example)).cameras
    assert (camera.id, camera.title, camera.field, camera.region) == (
        "north",
        "North half",
        "ssl-div-b",
        "full",
    )


def test_the_environment_wins_over_the_file_one_setting_at_a_time(tmp_path, monkeypatch):
    path = written(tmp_path, "server: {port: 9001, max_connections: 7}\ndata: kept-here\n")
    monkeypatch.setenv("TOUCHLINE_SERVER__PORT", "9002")
    settings = load_settings(path)
    assert (settings.server.port, settings.server.max_connections, str(settings.data)) == (
        9002,
        7,
        "kept-here",
    )


def test_what_is_given_wins_over_the_environment(monkeypatch):
    monkeypatch.setenv("TOUCHLINE_SERVER__PORT", "9002")
    assert load_settings(server={"port": 9003}).server.port == 9003


def test_the_environment_can_name_the_file(tmp_path, monkeypatch):
    monkeypatch.setenv("TOUCHLINE_CONFIG", str(written(tmp_path, "data: elsewhere\n")))
    assert str(load_settings().data) == "elsewhere"


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("server: {prt: 1}", "server.prt"),
        ("prot: 1", "prot"),
        ("server: {port: 70000}", "server.port"),
        ("server: {request_timeout_s: .nan}", "server.request_timeout_s"),
        ("jobs: {engine: 'dask://host'}", "jobs.engine"),
        ("token: short", "token"),
        ("publish: {group: x}", "Settings: publish: 'x' is not a multicast group. Give"),
        ("publish: {interval_s: .nan}", "publish"),
        ("publish: {ports: 1}", "publish.ports"),
        ("cameras: [{id: a, source: x}, {id: a, source: y}]", "same id"),
        ("cameras: [{id: ../a, source: x}]", "cameras.0.id"),
        ("a: [1", "not valid YAML"),
        ("- 1", "contains no settings"),
        ("8000: port", "8000"),
        ("null: port", "None"),
        ("data: !!python/object/apply:os.getcwd []", "not valid YAML"),
    ],
)
def test_a_mistake_in_the_file_is_named(tmp_path, text, said):
    with pytest.raises(BadInput, match=re.escape(said)) as refused:
        load_settings(written(tmp_path, text))
    assert refused.value.fix and refused.value.reason == "bad-settings"


def test_a_setting_that_was_removed_does_not_stop_a_server(tmp_path, monkeypatch):
    (tmp_path / "own.yaml").write_text(
        "sources: {producers: [/opt/mv], allowed_hosts: [sim.local]}\n"
    )
    assert load_settings(tmp_path / "own.yaml").sources.allowed_hosts == ("sim.local",)
    monkeypatch.setenv("TOUCHLINE_SOURCES__PRODUCERS", '["/opt/mv"]')
    assert load_settings(tmp_path / "own.yaml").sources.allowed_hosts == ("sim.local",)


def test_a_missing_file_is_said_to_be_missing(tmp_path):
    with pytest.raises(NotFound, match=r"nowhere\.yaml"):
        load_settings(tmp_path / "nowhere.yaml")


def test_a_variable_that_is_no_setting_is_named_with_the_one_that_was_meant():
    port, other = unknown_variables(
        [
            "TOUCHLINE_PORT",
            "TOUCHLINE_SERVER__PORT",
            "TOUCHLINE_CONFIG",
            "touchline_data",
            "TOUCHLINE_SERVICE_HOST",
            "PORT",
            "TOUCHLINES",
        ]
    )
    assert port == (
        "TOUCHLINE_PORT is not a setting and has no effect. "
        "Use TOUCHLINE_SERVER__PORT or TOUCHLINE_REFEREE__PORT."
    )
    assert (
        other.startswith("TOUCHLINE_SERVICE_HOST is not a setting")
        and "configs/touchline.yaml" in other
    )


def test_settings_are_frozen():
    with pytest.raises(ValueError, match="frozen"):
        Settings().data = "x"


def test_this_machine_alone_needs_no_token(tmp_path):
    settings = Settings(data=tmp_path)
    assert with_token(settings, say=print).token is None and not list(tmp_path.iterdir())


def test_any_other_address_gets_a_token_that_is_said_once_and_kept_for_its_owner(tmp_path):
    said = []
    settings = Settings(data=tmp_path, server={"host": "0.0.0.0"})
    token = with_token(settings, say=said.append).token.get_secret_value()
    assert len(token) >= 32 and token in said[0]
    assert (tmp_path / "token").stat().st_mode & 0o777 == 0o600
    assert with_token(settings, say=said.append).token.get_secret_value() == token
    assert len(said) == 1
