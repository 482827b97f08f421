"""Everything that takes a fit's body or reads a saved calibration, over REST and in the shell, and what must hold."""

import json
from collections.abc import Callable, Iterator
from typing import Any

from tests.support.activation import activate_despite
from tests.support.refusals import API, refusal, without_size
from touchline.formats import FORMATS

CAL = f"{API}/calibrations"
FRAMES = ("image", "corrected", "field")
POINTS = [[390.0, 290.0], [-50.0, 10.0], [0.0, 0.0], [1e7, -1e7]]


def sound(answer: Any, *expected: int) -> Any:
    """Return an answer's JSON, or None of another kind; no error of the server, no NaN, each refusal with its fix."""
    assert answer.status_code < 500, answer.text
    if answer.status_code >= 400:
        # it is this calibration's own
        assert refusal(answer)["type"] != "/problems/foreign-covariance", answer.text
        assert not expected or answer.status_code in expected, answer.text
        return None
    assert not expected or answer.status_code in expected, answer.text
    return (
        finite(answer.text)
        if answer.headers["content-type"].startswith("application/json")
        else None
    )


def finite(text: str) -> Any:
    """Read JSON as its standard has it."""

    def refuse(constant: str) -> None:
        raise AssertionError(f"{constant} in {text[:200]}")

    return json.loads(text, parse_constant=refuse)


def fitted(client: Any, body: dict[str, Any], snapshot: str) -> str | None:
    """Send a body to every route that fits; return the id of the calibration that is saved, None where none is.

    An attempt and a preview agree with what is saved, and what is refused leaves nothing behind.
    """
    before = saved(client)
    draft = {
        key: body[key]
        for key in ("field", "region", "rotate", "model", "options", "observations")
        if key in body
    }
    if sound(client.put(f"{API}/drafts/{snapshot}", json=draft)) is not None:
        kept = sound(client.get(f"{API}/drafts/{snapshot}"), 200)
        assert kept["observations"] == [{"z_mm": 0.0, **o} for o in body["observations"]], kept
    for route in ("preview", "attempt"):
        for query in ({"quick": True, "mesh_margin_px": 20}, {}):
            sound(client.post(f"{API}/fit/{route}", params=query, json=body))
    assert saved(client) == before
    answer = client.post(CAL, json={**without_size(body), "snapshot": snapshot})
    made = sound(answer)
    if answer.status_code != 201:
        assert saved(client) == before
        return None
    assert saved(client) == [made["id"], *before][:200]
    return made["id"]


def saved(client: Any) -> list[str]:
    return [
        row["id"]
        for row in sound(client.get(CAL, params={"brief": True, "limit": 200}), 200)["items"]
    ]


def read_everywhere(
    client: Any, id: str, other: str, snapshot: str, *, is_long: bool = True
) -> None:
    """Read a saved calibration by every route that takes one; those that take seconds only where it is_long."""
    for part in (_reading, _slow_reading)[: 1 + is_long]:
        for name, answer, expected in part(client, id, other, snapshot):
            try:
                sound(answer, *expected)
            except AssertionError as fault:
                raise AssertionError(f"{name}: {fault}") from None


Asked = tuple[str, Any, tuple[int, ...]]
Answers = Iterator[Asked]


def _askers(client: Any, id: str) -> tuple[Callable[..., Asked], Callable[..., Asked]]:
    """Return how to get below a calibration, and how to post anywhere."""

    def get(path: str, *expected: int, **query: Any) -> Asked:
        return f"{path} {query}", client.get(f"{CAL}/{id}{path}", params=query), expected

    def post(path: str, body: Any, *expected: int) -> Asked:
        return f"{path} {body}", client.post(f"{API}{path}", json=body), expected

    return get, post


def _reading(client: Any, id: str, other: str, snapshot: str) -> Answers:
    """What was asked, the answer, and with which status it may come; () where a refusal is as good."""
    get, post = _askers(client, id)
    for path in ("", "/overlay.json", "/residuals.json", "/report.json", "/report.html"):
        yield get(path, 200)
    for path in ("/overlay.json", "/residuals.json"):
        yield get(path, 200, frame="corrected", margin_px=30)
        yield get(path, 200, frame="corrected", margin_px=30, width=640)
    yield "list", client.get(CAL, params={"limit": 3}), (200,)
    yield get("/export/json", 200)
    for name in FORMATS:
        yield get(f"/export/{name}")
    for z_mm in (0, 150):
        yield get("/uncertainty.json", z_mm=z_mm)
        yield get("/uncertainty.png", z_mm=z_mm)
    for ending in ("json", "png"):
        yield get(f"/difference/{other}.{ending}")
        yield f"difference from {ending}", client.get(f"{CAL}/{other}/difference/{id}.{ending}"), ()
        yield get(f"/difference/{id}.{ending}")
    yield get("/corrected.png", width=320)
    yield (
        "correct",
        client.post(f"{CAL}/{id}/correct", params={"snapshot": snapshot, "width": 320}),
        (),
    )
    for source in FRAMES:
        for target in FRAMES:
            for z_mm in (0, 150):
                yield post(
                    f"/calibrations/{id}/transform",
                    {"from": source, "to": target, "points": POINTS, "z_mm": z_mm},
                    *((200,) if z_mm == 0 else (200, 409)),
                )
    made = client.get(f"{CAL}/{id}").json()
    yield post("/fields/painted", {"field": made["field_definition"], "calibration": id})
    activate_despite(client, id)
    for path in ("/publishing", "/cameras", "/calibrations/activations", "/fields"):
        yield path, client.get(API + path), (200,)


def _slow_reading(client: Any, id: str, other: str, snapshot: str) -> Answers:
    """The same for what takes a process or seconds of its own."""
    get, post = _askers(client, id)
    made = client.get(f"{CAL}/{id}").json()
    yield get("/exports", 200)
    for name in FORMATS:
        yield get(f"/export/{name}", approximate=True)
    yield get("/mesh")
    yield get("/corrected.jpg", width=320, margin_px=50)
    yield get("/scene.html", 200)
    yield post(f"/calibrations/{id}/check", {"snapshot": snapshot})
    yield post("/fields/seen", {"field": made["field_definition"], "calibration": id})
    yield post("/detections", {"snapshot": snapshot, "calibration": id})
    for a, b in ((id, other), (id, id)):
        for z_mm in (0.0, 150.0):
            yield post("/pairs", {"calibration_a": a, "calibration_b": b, "z_mm": z_mm})
            yield post(
                "/pairs/lines",
                {
                    "calibration_a": a,
                    "calibration_b": b,
                    "z_mm": z_mm,
                    "points_a": POINTS[:2],
                    "points_b": POINTS[:2],
                },
            )
    again = {
        "field": made["field"],
        "region": made["region"],
        "rotate": made["rotate"],
        "observations": made["observations"],
        "image_size": made["image_size"],
    }
    for sigma in ("own", "0"):  # its lens, known, for another fit of its points
        yield post(
            "/fit/attempt",
            {**again, "model": made["model"]["name"], "options": {"lens": id, "lens_sigma": sigma}},
        )
