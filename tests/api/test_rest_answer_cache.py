"""REST of answers about versions: made once, sent only to who has another one, refused as soon as they must be."""

import asyncio
import json

import pytest
from sqlalchemy import delete

from tests.support.paths import CLICKS
from tests.support.pictures import encoded, gradient
from tests.support.refusals import API, without_size
from tests.support.store_opener import damage_row
from touchline.api.routes import using
from touchline.core.records import Calibration
from touchline.store.tables import CalibrationRow, SnapshotRow

KEPT = {  # with parameters of which another answer comes; None where it has none
    "mesh": {"margin_px": 10},
    "overlay.json": {"frame": "corrected"},
    "residuals.json": {"frame": "corrected"},
    "uncertainty.json": {"z_mm": 100},
    "uncertainty.png": {"z_mm": 100},
    "difference/{other}.json": None,
    "difference/{other}.png": None,
    "report.json": None,
    "exports": None,
}


def path_of(id: str, name: str) -> str:
    return f"{API}/calibrations/{id}/{name.format(other=id)}"


CAMERA = {"id": "east", "source": "sim://table"}


@pytest.fixture(scope="module")
def first(standing) -> str:
    """A version that has all of these answers, of a camera, with a picture."""
    task = json.loads((CLICKS / "ssl_2008_half.json").read_text())
    assert standing.post(f"{API}/cameras", json=CAMERA).status_code == 201
    snapshot = standing.post(
        f"{API}/snapshots", files={"file": encoded("png", gradient(780, 580))}
    ).json()["id"]
    id = standing.post(
        f"{API}/calibrations",
        json={
            **without_size(task),
            "model": "division",
            "camera": CAMERA["id"],
            "snapshot": snapshot,
        },
    ).json()["id"]
    standing.get(path_of(id, "exports"))  # loads every format, which takes half a second once
    return id


@pytest.fixture
def version(standing, first) -> str:
    """A new version, for who changes it."""
    record = standing.get(path_of(first, "export/json")).content
    return standing.post(f"{API}/calibrations/import", files={"file": record}).json()["id"]


@pytest.mark.parametrize("name", KEPT)
def test_who_has_an_answer_is_not_sent_it_again(standing, first, name):
    path = path_of(first, name)
    sent = standing.get(path)
    etag = sent.headers["etag"]
    assert sent.status_code == 200 and sent.headers["cache-control"] == "private, no-cache"
    for known in (etag, f'"other", W/{etag}', "*"):
        again = standing.get(path, headers={"If-None-Match": known})
        assert (again.status_code, again.content, again.headers["etag"]) == (304, b"", etag)
        assert again.headers["cache-control"] == "private, no-cache"
    for known in ('"other"', etag.strip('"')):
        whole = standing.get(path, headers={"If-None-Match": known})
        assert (whole.status_code, whole.content) == (200, sent.content)
        assert whole.headers["content-type"] == sent.headers["content-type"]
    if KEPT[name] is not None:
        other = standing.get(path, params=KEPT[name], headers={"If-None-Match": etag})
        assert (
            other.status_code == 200
            and other.headers["etag"] != etag
            and other.content != sent.content
        )


@pytest.mark.parametrize("name", KEPT)
def test_an_answer_that_was_sent_before_waits_for_no_thread_and_parses_nothing(
    standing, first, name, monkeypatch
):
    path = path_of(first, name)
    sent = standing.get(path)

    def busy(*_given, **_more):
        raise AssertionError("work was done again")

    monkeypatch.setattr(standing.app.state.services, "run_in_thread", busy)
    monkeypatch.setattr(Calibration, "from_json", busy)
    monkeypatch.setattr(using.workflow, "overlay", busy)
    assert standing.get(path).content == sent.content


def test_a_version_that_was_deleted_or_damaged_is_refused_though_its_answers_are_in_memory(
    standing, version
):
    etags = {name: standing.get(path_of(version, name)).headers["etag"] for name in KEPT}

    def asked():
        return [
            standing.get(path_of(version, name), headers={"If-None-Match": etag})
            for name, etag in etags.items()
        ]

    assert {answer.status_code for answer in asked()} == {304}
    assert standing.delete(f"{API}/calibrations/{version}").status_code == 204
    assert {answer.status_code for answer in asked()} == {404}
    standing.post(f"{API}/calibrations/{version}/restore")
    assert {answer.status_code for answer in asked()} == {304}
    damage_row(
        standing.app.state.services.store,
        CalibrationRow,
        lambda text: text.replace("0", "1", 1),
        id=version,
    )
    assert {(answer.status_code, answer.json()["type"]) for answer in asked()} == {
        (503, "/problems/damaged-file")
    }


def test_a_report_is_another_one_as_soon_as_it_says_something_else(standing, first):
    path, seen, store = path_of(first, "report.json"), [], standing.app.state.services.store

    def changed(part: str, entry: str):
        answer = standing.get(path, headers={"If-None-Match": ", ".join(seen)})
        assert answer.status_code == 200, f"{part} {entry}"
        seen.append(answer.headers["etag"])
        assert len({*seen}) == len(seen)
        assert standing.get(path, headers={"If-None-Match": seen[-1]}).status_code == 304
        return answer.json()[part][entry]

    assert changed("calibration", "note") == ""
    standing.patch(f"{API}/calibrations/{first}", json={"note": "after the match"})
    assert changed("calibration", "note") == "after the match"
    store.calibrations.activate(first)
    assert changed("calibration", "active") is True
    etag = standing.get(f"{API}/cameras/{CAMERA['id']}").headers["etag"]
    standing.patch(
        f"{API}/cameras/{CAMERA['id']}", json={"name": "East"}, headers={"If-Match": etag}
    )
    assert changed("calibration", "camera_name") == "East"
    with store._database.writing("The deletion") as rows:
        rows.execute(delete(SnapshotRow))
    assert changed("picture", "shown") is False


@pytest.mark.parametrize(
    ("name", "sent"),
    [
        ("transform", {"json": {"from": "image", "to": "field", "points": [[100, 100]]}}),
        ("correct", {"files": {"file": b"no picture"}}),
    ],
)
def test_the_store_is_never_read_on_the_event_loop(standing, first, name, sent, monkeypatch):
    store, found = standing.app.state.services.store.calibrations, []

    def find(id, read=store.find):
        with pytest.raises(RuntimeError):  # no loop runs in this thread
            asyncio.get_running_loop()
        found.append(id)
        return read(id)

    monkeypatch.setattr(store, "find", find)
    standing.post(path_of(first, name), **sent)
    assert found == [first]


def test_a_list_of_versions_parses_each_once_and_knows_what_has_changed_in_the_field(
    standing, version, monkeypatch
):
    definition = {**standing.get(f"{API}/fields/ssl-2008").json(), "name": "own"}
    standing.put(f"{API}/fields/own", json=definition)
    record = standing.get(path_of(version, "export/json")).content.replace(b'"ssl-2008"', b'"own"')
    standing.post(f"{API}/calibrations/import", files={"file": record}, data={"camera": "own"})

    def listed():
        return standing.get(f"{API}/calibrations", params={"brief": True, "camera": "own"}).json()[
            "items"
        ]

    (before,) = listed()
    with monkeypatch.context() as patched:
        patched.setattr(Calibration, "from_json", None)
        assert listed() == [before] and before["field_changes"] == []
    standing.put(f"{API}/fields/own", json={**definition, "lines": definition["lines"][1:]})
    assert listed() == [{**before, "field_changes": [definition["lines"][0]["name"]]}]
    standing.patch(f"{API}/calibrations/{before['id']}", json={"note": "seen"})
    assert listed()[0]["note"] == "seen"


def test_a_list_of_cameras_asks_the_store_as_often_for_many_as_for_one(standing, monkeypatch):
    database, reads = standing.app.state.services.store._database, []

    def reading(read=database.reading):
        reads.append(1)
        return read()

    monkeypatch.setattr(database, "reading", reading)

    def count() -> tuple[int, int]:
        reads.clear()
        return len(standing.get(f"{API}/cameras").json()["items"]), len(reads)

    cameras, before = count()
    for number in range(3):
        standing.post(f"{API}/cameras", json={"id": f"more-{number}", "source": "sim://table"})
    assert count() == (cameras + 3, before)
    one = [
        camera
        for camera in standing.get(f"{API}/cameras").json()["items"]
        if camera["id"] == "more-1"
    ]
    assert one == [standing.get(f"{API}/cameras/more-1").json()]


@pytest.mark.parametrize("path", ["fields", "models"])
def test_long_lists_that_change_seldom_are_packed_and_not_sent_twice(standing, path):
    plain = standing.get(f"{API}/{path}", headers={"Accept-Encoding": "identity"})
    packed = standing.get(f"{API}/{path}", headers={"Accept-Encoding": "gzip"})
    assert packed.json() == plain.json() and "content-encoding" not in plain.headers
    assert packed.headers["content-encoding"] == "gzip"
    assert int(packed.headers["content-length"]) < len(plain.content) / 4
    known = {"Accept-Encoding": "gzip", "If-None-Match": packed.headers["etag"]}
    again = standing.get(f"{API}/{path}", headers=known)
    assert (again.status_code, again.content) == (304, b"")
