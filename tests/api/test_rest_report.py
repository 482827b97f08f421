"""REST of reports: one page that asks for nothing else, and the same as JSON, for every model and any record."""

import copy
import json
import re
from functools import cache
from html import unescape
from html.parser import HTMLParser

import numpy as np
import pytest

from tests.support.operator import FIELD, REGION, SIZE, reference_camera
from tests.support.pictures import encoded, gradient
from tests.support.refusals import API, refusal
from tests.support.sim_clicks import border_observations
from tests.support.tiers import rounds
from touchline.fitting import FITTERS

NAUGHTY = "<script>alert(1)</script>\"'><img src=http://evil.example/x onerror=alert(2)> & {{7*7}} \u202e \U0001f600"
MB = 1_000_000
ALLOWED = {
    "a",
    "html",
    "head",
    "meta",
    "title",
    "style",
    "body",
    "h1",
    "h2",
    "p",
    "b",
    "div",
    "span",
    "data",
    "table",
    "thead",
    "tbody",
    "tr",
    "th",
    "td",
    "ul",
    "li",
    "figure",
    "figcaption",
    "svg",
    "image",
    "path",
    "img",
    "code",
    "pre",
}


class Read(HTMLParser):
    """What a page holds: its elements, its addresses, its numbers as machines read them, its words."""

    def __init__(self, html: str) -> None:
        super().__init__()
        self.elements: set[str] = set()
        self.addresses: list[str] = []
        self.attributes: set[str] = set()
        self.numbers: list[float] = []
        self.words: list[str] = []
        self.feed(html)

    def handle_starttag(self, tag, attrs):
        self.elements.add(tag)
        self.attributes |= {name for name, _ in attrs}
        self.addresses += [
            value
            for name, value in attrs
            if name in ("src", "href", "xlink:href", "srcset", "action")
        ]
        if tag == "data":
            self.numbers.append(float(dict(attrs)["value"]))

    def handle_data(self, data):
        self.words.append(data)

    @property
    def text(self) -> str:
        return " ".join(self.words)


def strict(answer):
    return json.loads(
        answer.text, parse_constant=lambda constant: pytest.fail(f"{constant} in an answer")
    )


def a_field_that(client, **changes) -> str:
    body = {**FIELD.to_json(), "name": "seen", **changes}
    assert client.put(f"{API}/fields/seen", json=body).status_code in (200, 201)
    return "seen"


def observed() -> list:
    camera = reference_camera("strong", 8)
    return [
        o.to_json()
        for o in border_observations(
            camera, REGION, 12, 0.3, np.random.default_rng(3), anywhere=True
        )
    ]


@cache
def smooth_picture() -> bytes:
    return encoded("png", gradient(SIZE.width, SIZE.height))


def kept(client, model="brown-conrady", picture=None, **more) -> dict:
    """A calibration of the reference camera, by REST."""
    a_field_that(client)
    snapshot = client.post(f"{API}/snapshots", files={"file": picture or smooth_picture()}).json()[
        "id"
    ]
    answer = client.post(
        f"{API}/calibrations",
        json={
            "field": "seen",
            "region": "full",
            "model": model,
            "snapshot": snapshot,
            "observations": observed(),
            **more,
        },
    )
    assert answer.status_code == 201, answer.text
    return answer.json()


@pytest.fixture(scope="module")
def standing_kept(standing):
    """Of each model one that all tests of this file read."""
    known = {}

    def of(model="brown-conrady") -> dict:
        if model not in known:
            known[model] = kept(standing, model)
        return known[model]

    return of


def both(client, id: str) -> tuple[str, dict]:
    html, said = (
        client.get(f"{API}/calibrations/{id}/report.html"),
        client.get(f"{API}/calibrations/{id}/report.json"),
    )
    assert html.status_code == said.status_code == 200, html.text[:500] + said.text[:500]
    assert html.headers["content-type"] == "text/html; charset=utf-8"
    return html.text, strict(said)


def stands_alone(html: str) -> Read:
    """Nothing but our own elements, no address but data, no code."""
    page = Read(html)
    assert page.elements <= ALLOWED, page.elements - ALLOWED
    assert not [name for name in page.attributes if name.startswith("on")]
    assert all(
        re.match(r"data:image/(png|jpeg);base64,[A-Za-z0-9+/=]+\Z", address)
        for address in page.addresses
        if address != "scene.html"
    )  # fixed, beside the file; it is followed by hand alone
    css = re.search(r"<style>(.*?)</style>", html, re.DOTALL)[1]
    assert "url(" not in css and "@import" not in css
    assert (
        "nan" not in {word.lower() for word in re.findall(r"[A-Za-z]+", page.text)}
        and "Infinity" not in page.text
    )
    assert len(html.encode()) <= 3 * MB
    return page


def numbers_of(said: dict) -> list[float]:
    """Every number that a reader of the page must find."""
    parts = [
        *(it["value"] for it in said["figures"].values()),
        *(v for it in said["distortion"]["per_border"].values() for v in it.values()),
        *(
            it[key]
            for it in said["per_feature"]
            for key in ("n", "outliers", "rms_px", "rms_mm", "max_mm")
        ),
        *(
            it["map"][key]
            for it in said["uncertainty"].values()
            if it["map"]
            for key in ("rms", "median", "max")
        ),
        *(it[key] for it in said["outliers"] for key in ("px", "mm")),
        said["verdict"]["mm"],
    ]
    return [float(number) for number in parts if number is not None]


@pytest.mark.parametrize("model", FITTERS)
def test_every_model_has_a_report_whose_page_and_json_say_the_same_numbers(
    standing, standing_kept, model
):
    calibration = standing_kept(model)
    html, said = both(standing, calibration["id"])
    page = stands_alone(html)
    shown = set(page.numbers)
    assert not [number for number in numbers_of(said) if number not in shown]
    assert said["figures"]["rms_px"]["value"] == calibration["report"]["rms_px"]
    assert said["verdict"]["sentence"] == calibration["report"]["verdict"]["sentence"]
    assert said["verdict"]["sentence"] in page.text and html.count("data:image/jpeg") == 2
    for told in (
        calibration["id"],
        calibration["image_sha256"],
        said["model"]["parameters_sha256"],
        calibration["software"],
        said["model"]["title"],
    ):
        assert told in page.text
    for warning in calibration["report"]["warnings"]:
        assert warning["text"] in page.text and warning["fix"] in page.text
    if model == "polynomial":
        assert "only on the carpet" in said["uncertainty"]["hat"]["why"]
    sigma = calibration["report"]["sigma_mm"]
    assert html.count("data:image/png") == (0 if sigma is None else 1 + ("hat" in sigma))
    for name, known in (("carpet", sigma), ("hat", (sigma or {}).get("hat"))):
        part = said["uncertainty"][name]
        assert (part["map"] is None) == (known is None)
        if known is None:
            assert part["why"] in page.text and part["fix"] in page.text
        else:
            assert part["map"]["max"] == pytest.approx(known["max"], rel=1e-9)


def test_the_number_that_is_read_is_the_number_of_the_record(standing, standing_kept):
    html, said = both(standing, standing_kept()["id"])
    for it in said["figures"].values():
        if it["value"] is not None and it["unit"] in ("px", "mm"):
            assert f">{it['value']:.2f} {it['unit']}<" in html, it


def test_what_is_expected_on_the_carpet_and_at_hat_height_are_two_numbers(standing, standing_kept):
    calibration = standing_kept()
    expected, figures = (
        calibration["report"]["sigma_mm"],
        both(standing, calibration["id"])[1]["figures"],
    )
    assert figures["expected_mm"]["value"] == expected["rms"] != expected["hat"]["rms"]
    assert figures["expected_hat_mm"]["value"] == expected["hat"]["rms"]


def test_names_and_notes_of_operators_are_text_and_nothing_else(standing):
    client = standing
    camera = {
        "id": "evil",
        "name": NAUGHTY[:60],
        "source": "sim://table",
        "field": "table",
        "region": "full",
    }
    assert client.post(f"{API}/cameras", json=camera).status_code == 201
    calibration = kept(client, note=NAUGHTY, camera="evil")
    page = stands_alone(both(client, calibration["id"])[0])
    assert NAUGHTY in page.text and NAUGHTY[:60] in page.text


def exported(client, id: str) -> dict:
    return client.get(f"{API}/calibrations/{id}/export/json").json()


def imported(client, record: dict) -> str:
    answer = client.post(f"{API}/calibrations/import", files={"file": json.dumps(record).encode()})
    assert answer.status_code == 201, answer.text
    return answer.json()["id"]


def test_an_imported_one_says_that_it_has_no_picture(standing, standing_kept):
    id = imported(standing, exported(standing, standing_kept()["id"]))
    html, said = both(standing, id)
    page = stands_alone(html)
    assert "data:image/jpeg" not in html and html.count("data:image/png") == 2
    assert said["picture"]["shown"] is False and said["picture"]["why_not"] in page.text


def bomb(value, rng, depth=0):
    """The same record with any part of it replaced by what nobody means."""
    junk = [
        None,
        True,
        "x",
        NAUGHTY,
        10**400,
        -1e308,
        1e308,
        [],
        {},
        [[]],
        {"a": NAUGHTY},
        0,
        [NAUGHTY] * 3,
        "\ud800",
    ]
    if rng.random() < 0.06 and depth:
        return copy.deepcopy(junk[rng.integers(len(junk))])
    if isinstance(value, dict):
        return {key: bomb(part, rng, depth + 1) for key, part in value.items()}
    return [bomb(part, rng, depth + 1) for part in value] if isinstance(value, list) else value


STRANGE = {
    "nothing": {},
    "no verdict": {"verdict": {"level": [], "mm": NAUGHTY, "sentence": NAUGHTY}},
    "no covariance": {"covariance": "no"},
    "of no parameter": {"covariance": {"names": [NAUGHTY], "matrix": [[1.0]]}},
    "of no numbers": {"covariance": {"names": ["height"], "matrix": []}},
    "of huge numbers": {"covariance": {"names": ["height"] * 3, "matrix": [[1e308] * 3] * 3}},
    "half a click": {"next_click": {"point": [1.0, 1.0], "worst_mm_then": 1.0}},
    "many warnings": {"warnings": [{"text": NAUGHTY, "fix": NAUGHTY}] * 5000},
    "many features": {"per_feature": [{"feature": NAUGHTY}] * 5000},
}


@pytest.mark.parametrize("report", STRANGE.values(), ids=STRANGE.keys())
def test_a_strangers_report_breaks_neither_the_page_nor_the_json(standing, standing_kept, report):
    record = exported(standing, standing_kept()["id"])
    stands_alone(both(standing, imported(standing, {**record, "report": report}))[0])


@rounds("seeds", range(1, 3), range(1, 42))
def test_a_report_in_which_anything_was_replaced_breaks_neither(standing, standing_kept, seeds):
    record = exported(standing, standing_kept()["id"])
    for seed in seeds:
        report = bomb(record["report"], np.random.default_rng(seed))
        stands_alone(both(standing, imported(standing, {**record, "report": report}))[0])


def test_a_camera_that_nobody_can_write_in_a_header_still_has_a_report(standing, standing_kept):
    record = exported(standing, standing_kept()["id"])
    id = imported(standing, {**record, "camera": 'no\r\nSet-Cookie: "x" é\U0001f600'})
    answer = standing.get(f"{API}/calibrations/{id}/report.html")
    assert answer.status_code == 200 and "set-cookie" not in answer.headers
    header = answer.headers["content-disposition"]
    assert re.fullmatch(
        r"""inline; filename="[\w.-]+-report\.html"; filename\*=UTF-8''[\w.%-]+-report\.html""",
        header,
    )


@pytest.mark.long
def test_large_noisy_pictures_are_reduced_until_the_file_is_small(client):
    scale = 2  # of noise: 16 MB as PNG, 5 MB as JPEG
    pixels = np.random.default_rng(0).integers(
        0, 255, (SIZE.height * scale, SIZE.width * scale, 3), np.uint8
    )
    observations = [
        {
            **o,
            "points": [[(x + 0.5) * scale - 0.5, (y + 0.5) * scale - 0.5] for x, y in o["points"]],
        }
        for o in observed()
    ]
    html, _ = both(
        client, kept(client, picture=encoded("png", pixels), observations=observations)["id"]
    )
    stands_alone(html)
    assert html.count("data:image/jpeg") == 2


def test_the_page_allows_itself_nothing(standing, standing_kept):
    id = standing_kept()["id"]
    answer = standing.get(f"{API}/calibrations/{id}/report.html")
    policy = answer.headers["content-security-policy"]
    assert policy.startswith("default-src 'none';") and "script-src" not in policy
    assert re.search(
        'http-equiv="Content-Security-Policy" content="default-src \'none\';', unescape(answer.text)
    )


def test_an_outlier_is_listed_and_crossed_out(standing):
    observations = observed()
    observations[0]["points"][3][0] += 40
    html, said = both(standing, kept(standing, observations=observations)["id"])
    (stray,) = said["outliers"]
    assert (
        stray["feature"] == observations[0]["feature"] and stray["index"] == 3 and stray["px"] > 20
    )
    assert "#d00000" in html and f"{stray['px']:.2f} px<" in html


def test_a_report_of_nothing_is_404(standing):
    for kind in ("html", "json"):
        refusal(
            standing.get(f"{API}/calibrations/nobody/report.{kind}"), 404, "unknown-calibration"
        )
