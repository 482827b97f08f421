"""Files over REST: every format out with what it costs, and in again as a calibration, a lens or a fit of points."""

import email
import json
import re
from urllib.parse import unquote

import cv2
import numpy as np
import pytest

from tests.support.activation import activate_despite
from tests.support.refusals import API, refusal
from tests.support.tiers import long
from touchline.api.responses import attachment
from touchline.core.geometry import ImageSize
from touchline.core.quarter_turn import QuarterTurn
from touchline.formats import FORMATS

CAL = f"{API}/calibrations"
LENS_FORMATS = [name for name in FORMATS if FORMATS[name].lenses]


@pytest.fixture(scope="module")
def made(standing, standing_calibration):
    """A calibration of the standing clicks by each model that a test asks for, once."""
    kept = {"polynomial": standing_calibration}

    def of(model: str) -> dict:
        if model not in kept:
            body = {
                k: standing_calibration[k]
                for k in ("field", "region", "image_size", "observations")
            }
            answer = standing.post(CAL, json={**body, "model": model, "camera": "north"})
            assert answer.status_code == 201, answer.text
            kept[model] = answer.json()
        return kept[model]

    return of


def exported(client, calibration, format, **params):
    return client.get(f"{CAL}/{calibration['id']}/export/{format}", params=params)


def imported(client, data, name="file", **texts):
    return client.post(f"{CAL}/import", files={"file": (name, data)}, data=texts)


def field_of(client, calibration, pixels):
    body = {"from": "image", "to": "field", "points": pixels}
    answer = client.post(f"{CAL}/{calibration['id']}/transform", json=body)
    return np.array(answer.json()["points"], float)


@pytest.mark.parametrize("format", LENS_FORMATS)
def test_a_model_that_a_format_cannot_hold_is_409_and_with_approximate_its_error_is_told(
    standing, made, format
):
    calibration = made("polynomial")
    problem = refusal(exported(standing, calibration, format), 409, "format-cannot-hold")
    assert "approximate=true" in problem["fix"]
    answer = exported(standing, calibration, format, approximate="true")
    worst, *rest = answer.headers["x-approximation-error-mm"].split(";")
    # 42 mm: boundary polynomials are no camera; one that is fitted to the same clicks is 64 mm from them
    assert answer.status_code == 200 and 0 < float(worst) < 50 and rest[0].startswith("rms=")
    listed = standing.get(f"{CAL}/{calibration['id']}/exports").json()["items"]
    loss = next(f["loss"] for f in listed if f["format"] == format)
    assert float(worst) == pytest.approx(loss["worst_mm"], abs=6e-4)
    assert float(rest[0][4:]) == pytest.approx(loss["rms_mm"], abs=6e-4)
    assert (
        f'-v{calibration["version"]}{FORMATS[format].suffix}"'
        in answer.headers["content-disposition"]
    )
    back = imported(standing, answer.content).json()
    pixels = [[200.0, 150.0], [400.0, 300.0], [600.0, 450.0], [420.0, 120.0]]
    off = np.linalg.norm(
        field_of(standing, back, pixels) - field_of(standing, calibration, pixels), axis=1
    )
    assert off.max() < float(worst) + 0.5


@pytest.mark.parametrize(
    "model, formats",
    [
        ("brown-conrady", ("opencv", "ros", "mrcal", "photonvision")),
        ("fisheye", ("opencv", "ros", "kalibr")),
        ("ssl", ("ssl-vision",)),
    ],
)
def test_what_is_held_comes_back_as_a_new_version_that_says_the_same(
    standing, made, model, formats
):
    calibration = made(model)
    pixels = [[100.0, 100.0], [390.0, 290.0], [700.0, 500.0]]
    for format in formats:
        answer = exported(standing, calibration, format)
        assert answer.status_code == 200 and answer.headers["content-type"].startswith(
            FORMATS[format].media_type
        )
        assert ("x-approximation-error-mm" in answer.headers) == (format == "ssl-vision")
        back = imported(standing, answer.content, camera="south")
        assert back.status_code == 201 and back.headers["location"] == f"{CAL}/{back.json()['id']}"
        record = back.json()
        assert (
            record["camera"] == "south"
            and "Imported from" in record["note"]
            and record["observations"] == []
        )
        assert record["report"]["verdict"]["level"] == "unknown"
        assert record["report"]["warnings"][0]["reason"] == "imported"
        np.testing.assert_allclose(
            field_of(standing, record, pixels),
            field_of(standing, calibration, pixels),
            atol=0.01 if format == "ssl-vision" else 1e-6,
        )


def test_everything_that_can_be_asked_of_a_calibration_can_be_asked_of_an_imported_one(
    standing, made
):
    back = imported(standing, exported(standing, made("brown-conrady"), "opencv").content).json()
    asked = (
        "",
        "/exports",
        "/overlay.json",
        "/residuals.json",
        "/uncertainty.json",
        "/report.html",
        "/report.json",
        f"/difference/{made('brown-conrady')['id']}.json",
        *(f"/export/{name}?approximate=true" for name in FORMATS),
    )
    for path in asked:
        answer = standing.get(f"{CAL}/{back['id']}{path}")
        assert answer.status_code in (200, 409), (path, answer.text)
        # nothing is known of its error
        assert answer.status_code == 200 or path == "/uncertainty.json"
    activate_despite(standing, back["id"])


def test_the_list_says_what_each_format_holds_and_costs(standing, made):
    told = {
        f["format"]: f
        for f in standing.get(f"{CAL}/{made('brown-conrady')['id']}/exports").json()["items"]
    }
    assert list(told) == list(FORMATS)
    assert told["opencv"]["exact"] and told["opencv"]["loss"] is None
    assert not told["ssl-vision"]["exact"] and 0 < told["ssl-vision"]["loss"]["worst_mm"] < 50
    assert told["npz"]["reads"] is False and told["json"]["holds"]
    again = standing.get(f"{CAL}/{made('polynomial')['id']}/exports").json()["items"]
    assert all(f["loss"]["hat_worst_mm"] is None for f in again if f["format"] in LENS_FORMATS)


def test_a_file_of_another_program_is_kept_as_a_lens_that_a_fit_holds(
    standing, standing_calibration
):
    file = json.dumps(
        {
            "resolution": {"width": 780, "height": 580},
            "distCoeffs": {"rows": 1, "cols": 5, "type": 6, "data": [-0.2, 0.03, 0, 0, 0]},
            "cameraIntrinsics": {
                "rows": 3,
                "cols": 3,
                "type": 6,
                "data": [620, 0, 389.5, 0, 620, 289.5, 0, 0, 1],
            },
        }
    )
    answer = imported(standing, file.encode(), "cam.json", camera="north")
    lens = answer.json()
    assert answer.status_code == 201 and answer.headers["location"] == f"{API}/lenses/{lens['id']}"
    assert lens["model"] == "brown-conrady" and "PhotonVision" in lens["note"]
    listed = standing.get(f"{API}/lenses").json()["items"]
    assert [item["note"] for item in listed if item["id"] == lens["id"]] == [lens["note"]]
    body = {k: standing_calibration[k] for k in ("field", "region", "image_size", "observations")}
    fit = standing.post(
        CAL, json={**body, "model": "brown-conrady", "options": {"lens": lens["id"]}}
    )
    assert fit.status_code == 201 and fit.json()["model"]["parameters"][
        "focal_px"
    ] == pytest.approx(620)
    own = standing.post(
        CAL,
        json={
            **body,
            "model": "brown-conrady",
            "options": {"lens": lens["id"], "lens_sigma": "own"},
        },
    )
    refusal(own, 422, "lens-sigma-unknown")


@pytest.mark.parametrize(
    "model, format", [("brown-conrady", "json"), ("brown-conrady", "opencv"), ("polynomial", "csv")]
)
def test_a_file_from_before_the_images_were_turned_is_turned(standing, made, model, format):
    calibration = made(model)
    data = exported(standing, calibration, format).content
    beside = {"field": "ssl-2008", "region": "half", "model": "polynomial"}
    more = {**beside, "image_size": "580x780"} if format == "csv" else {}
    pixels = np.array([[100.0, 100.0], [390.0, 290.0], [700.0, 500.0]])
    for turn_deg in (0, 90, 270):
        size = {"image_size": "780x580"} if more and not turn_deg else {}
        answer = imported(standing, data, turn=str(turn_deg), **{**more, **size})
        assert answer.status_code == 201, answer.text
        record, turn = answer.json(), QuarterTurn(turn_deg, ImageSize(780, 580))
        assert record["image_size"] == [*turn.size_after]
        assert ("The file was turned by 90°" in record["note"]) == (turn_deg != 0)
        np.testing.assert_allclose(
            field_of(standing, record, turn.points(pixels).tolist()),
            field_of(standing, calibration, pixels.tolist()),
            atol=1e-6 if format != "csv" else 1.0,
        )
        # our own file says its covered area; of another's the one that is upright in the image now
        assert (record["rotate"] == calibration["rotate"]) or format == "opencv"
    refusal(imported(standing, data, turn="45"), 422, "bad-turn")
    refusal(imported(standing, data, turn="-90"), 422, "bad-request")


def test_a_table_of_points_is_fitted(standing, made):
    table = exported(standing, made("polynomial"), "csv").content
    refusal(imported(standing, table), 422, "no-field")
    answer = imported(
        standing,
        table,
        field="ssl-2008",
        region="half",
        image_size="780x580",
        camera="north",
        model="polynomial",
    )
    assert answer.status_code == 201, answer.text
    assert len(answer.json()["observations"]) == 4 and answer.json()["report"]["rms_px"] < 1


@pytest.mark.parametrize(
    "texts, status",
    [
        ({"rotate": "45"}, 422),
        ({"rotate": "x"}, 422),
        ({"image_size": "big"}, 422),
        ({"image_size": "1x1"}, 422),
        ({"image_size": "780x500"}, 409),
        ({"field": "moon"}, 404),
        ({"field": "../.."}, 422),
        ({"region": "moon"}, 404),
        ({"camera_id": "99999999999"}, 422),
        ({"camera": "a b"}, 422),
        ({"colour": "red"}, 422),
    ],
)
def test_what_is_said_beside_a_file_is_checked(standing, made, texts, status):
    refusal(
        imported(standing, exported(standing, made("brown-conrady"), "opencv").content, **texts),
        status,
    )


def test_json_says_everything_itself(standing, made):
    data = exported(standing, made("brown-conrady"), "json").content
    assert imported(standing, data, camera="west").json()["camera"] == "west"
    refusal(imported(standing, data, field="ssl-2008"), 422, "bad-request")


def test_a_camera_number_of_the_league_is_told_and_checked(standing, made):
    assert exported(standing, made("ssl"), "ssl-vision", camera_id=3).status_code == 200
    for wrong in (-1, 2**32, "x"):
        assert exported(standing, made("ssl"), "ssl-vision", camera_id=wrong).status_code == 422


def test_opencv_sees_a_robots_hat_where_we_see_it(standing, made, tmp_path):
    calibration = made("brown-conrady")
    (tmp_path / "a.yml").write_bytes(exported(standing, calibration, "opencv").content)
    file = cv2.FileStorage(str(tmp_path / "a.yml"), cv2.FILE_STORAGE_READ)
    k, d, r, t = (
        file.getNode(n).mat()
        for n in (
            "camera_matrix",
            "distortion_coefficients",
            "rotation_vector",
            "translation_vector",
        )
    )
    place = [1500.0, 300.0]
    ours = standing.post(
        f"{CAL}/{calibration['id']}/transform",
        json={"from": "field", "to": "image", "points": [place], "z_mm": 150},
    ).json()["points"][0]
    np.testing.assert_allclose(
        cv2.projectPoints(np.array([[*place, 150.0]]), r, t, k, d)[0].ravel(), ours, atol=1e-6
    )


CAMERAS = (
    "Südtribüne",
    'no\r\nSet-Cookie: "x"',
    "a/b\\c:d",
    "..",
    " ",
    "north; filename=evil.exe",
    "\U0001f3a5" * 64,
    "\u202excod.exe",
    "100 %",
    "x" * 64,
    "kamera-北",
)


@pytest.mark.parametrize("camera", CAMERAS)
def test_a_camera_of_any_name_gives_a_file_that_any_system_can_keep(standing, made, camera):
    kept = imported(
        standing, exported(standing, made("brown-conrady"), "json").content, camera="north"
    ).json()
    record = json.loads(exported(standing, kept, "json").content)
    id = imported(standing, json.dumps({**record, "camera": camera})).json()["id"]
    answer = standing.get(f"{CAL}/{id}/export/opencv")
    assert answer.status_code == 200 and "set-cookie" not in answer.headers
    header = answer.headers["content-disposition"]
    told = email.message_from_string(f"Content-Disposition: {header}\n\n")
    assert told.get_content_disposition() == "attachment" and len(header) < 1500
    plain = re.fullmatch(r'attachment; filename="([A-Za-z0-9._-]+)"(; filename.=.*)?', header)[1]
    true = told.get_filename() if "filename*" in header else plain
    for name in (
        plain,
        unquote(re.sub(r".*filename\*=UTF-8''", "", header)) if "filename*" in header else true,
    ):
        assert (
            name.endswith(".yml")
            and re.search(r"-v\d+\.|^v\d+\.", name)
            and not set(name) & set('/\\:*?"<>|\r\n')
        )
        assert len(name) <= 80 and name[0] not in "-." and "\u202e" not in name
    if camera == "Südtribüne":
        assert (
            plain.startswith("Sudtribune-v") and "filename*=UTF-8''S%C3%BCdtrib%C3%BCne-v" in header
        )


def test_a_name_of_two_hundred_characters_keeps_its_end():
    header = attachment(f"{'ü' * 200}-v12.camchain.yaml")
    assert header.startswith('attachment; filename="uuu') and header.split(";")[1].endswith(
        '-v12.camchain.yaml"'
    )
    assert header.endswith("-v12.camchain.yaml") and attachment("").startswith(
        'attachment; filename="file"'
    )
    assert attachment("\ud800-v1.json").isascii()


COVARIANCES = (  # each absurd in its own way
    "no",
    7,
    [],
    [["height"]],
    {},
    {"names": "height", "matrix": [[1.0]]},
    {"names": ["height"], "matrix": [[-1.0]]},
    {"names": ["height"], "matrix": [["1", None]]},
    {"names": ["height"], "matrix": []},
    {"names": [], "matrix": []},
    {"names": ["heigth"], "matrix": [[1.0]]},
    {"names": ["line_0"], "matrix": [[1.0]]},
    {"names": [7], "matrix": [[1.0]]},
    {"names": ["height", "height"], "matrix": [[1.0, 0.0], [0.0, 1.0]]},
    {"names": ["height"], "matrix": [[10**400]]},
    {"names": ["height"], "matrix": [[1e308]]},
    {"names": ["height", "x"], "matrix": [[1.0, 2.0], [2.0, 1.0]]},
    {"names": ["height", "x"], "matrix": [[1.0, 0.5], [-0.5, 1.0]]},
    {"names": ["height", "x"], "matrix": [[1.0]]},
    {"names": [["height"]], "matrix": [[1.0]]},
    {"names": {"height": 1}, "matrix": {"height": 1}},
)


@pytest.mark.parametrize(
    "model", ["brown-conrady", *(long(model) for model in ("homography", "polynomial"))]
)
def test_a_covariance_that_is_not_its_models_is_told_everywhere_and_never_becomes_a_number(
    standing, made, model
):
    record = json.loads(exported(standing, made(model), "json").content)
    for covariance in COVARIANCES:
        report = {**record["report"], "covariance": covariance}
        answer = imported(standing, json.dumps({**record, "report": report}))
        assert answer.status_code == 201, answer.text
        asked = f"{CAL}/{answer.json()['id']}"
        reason = "no-covariance" if model == "polynomial" else "foreign-covariance"
        for path in ("uncertainty.json", "uncertainty.png"):
            refusal(standing.get(f"{asked}/{path}"), 409, reason)
        told = standing.get(f"{asked}/report.json")
        assert told.status_code == 200 and told.json()["uncertainty"]["carpet"]["map"] is None
        assert (
            told.json()["uncertainty"]["carpet"]["fix"]
            and standing.get(f"{asked}/report.html").status_code == 200
        )


def test_a_covariance_from_elsewhere_that_can_be_its_models_is_believed(standing, made):
    record = json.loads(exported(standing, made("brown-conrady"), "json").content)
    back = imported(standing, json.dumps(record)).json()["id"]
    own, told = (
        standing.get(f"{CAL}/{id}/uncertainty.json").json()
        for id in (made("brown-conrady")["id"], back)
    )
    assert own == told and 0 < told["rms"] < told["max"]


@pytest.mark.parametrize(
    "report",
    [
        {},
        {"verdict": None, "distortion": 7, "per_feature": "x", "warnings": [3]},
        {
            "verdict": {"level": 3},
            "distortion": {"per_border": {"left": []}},
            "per_feature": [{}],
            "warnings": [{}],
        },
    ],
    ids=["empty", "other kinds", "half"],
)
def test_a_report_that_lacks_something_is_completed_so_that_every_reader_shows_it(
    client, standing_calibration, report
):
    made = client.post(
        f"{CAL}/import",
        files={
            "file": json.dumps(
                {
                    "format": "touchline-calibration",
                    "format_version": 1,
                    **standing_calibration,
                    "report": report,
                }
            )
        },
    )
    assert made.status_code == 201, made.text
    shown = made.json()["report"]
    assert (
        shown["verdict"].keys() == {"level", "mm", "sentence"}
        and shown["distortion"]["before_pct"] is None
    )
    assert shown["distortion"]["per_border"]["left"] == {"before_pct": None, "after_pct": None}
    assert all(row["residuals"] == [] for row in shown["per_feature"]) and isinstance(
        shown["warnings"], list
    )
    assert client.get(f"{CAL}/{made.json()['id']}/report.html").status_code == 200


def test_a_picture_that_no_camera_takes_is_refused_before_anything_is_as_large_as_it(
    client, standing_calibration
):
    """A remap table of 65,536 × 65,536 px took 7 GB of the server."""
    parameters = {
        **standing_calibration["model"]["parameters"],
        "image_size": {"width": 65536, "height": 65536},
    }
    made = client.post(
        f"{CAL}/import",
        files={
            "file": json.dumps(
                {
                    "format": "touchline-calibration",
                    "format_version": 1,
                    **standing_calibration,
                    "image_size": [65536, 65536],
                    "model": {**standing_calibration["model"], "parameters": parameters},
                }
            )
        },
    )
    refusal(made, 422, "bad-image-size")
