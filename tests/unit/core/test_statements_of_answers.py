"""Answers carry what their sentences state: errors, warnings, states of cameras, advice, jobs, events."""

import json

import pytest

from touchline.core.errors import BadInput, Unavailable
from touchline.core.geometry import ImageSize
from touchline.core.jobs import Job, problem_of, subprogress
from touchline.core.records import Warning
from touchline.core.statements import Sentence, join, say, sentence_in
from touchline.images.screen import screen
from touchline.live.supervisor import ProcessStatus, calibration_mismatch, stall_reason
from touchline.processes.framing import error_from_json, problem_json
from touchline.sources import Identity
from touchline.store.files import PictureQuota, translate_disk_errors
from touchline.vision import light
from touchline.vision.zones import zone_names

LOST, CHECK = (
    say("camera.lost", "No frame for {seconds:.1f} s.", seconds=1.25),
    say("fix.check", "Check it."),
)
STATED = {"code": "camera.lost", "values": {"seconds": 1.2}}


def test_an_error_and_a_warning_state_what_they_say():
    error = Unavailable(LOST, CHECK, reason="lost")
    assert error.to_json() == {
        "reason": "lost",
        "what": "No frame for 1.2 s.",
        "fix": "Check it.",
        "statements": {"what": [STATED], "fix": [{"code": "fix.check", "values": {}}]},
    }
    assert Warning("lost", LOST, "Wait.").to_json()["statements"] == {"text": [STATED]}
    assert problem_of(error)["statements"]["detail"] == [STATED]
    assert "statements" not in Warning("lost", "Lost.", "Wait.").to_json()


def test_an_error_states_the_same_when_it_has_crossed_to_another_process():
    sent = json.loads(json.dumps(problem_json(BadInput(join(LOST, "Really."), CHECK))))
    come = error_from_json(sent)
    assert isinstance(come, BadInput)
    assert come.to_json() == {name: value for name, value in sent.items() if name != "kind"}
    assert come.to_json()["statements"]["what"] == [STATED, {"text": "Really."}]
    assert type(sentence_in({"what": "Plain."}, "what")) is str


def test_a_camera_states_why_it_is_not_live_and_what_differs():
    status = ProcessStatus.initial(0.0)
    assert stall_reason(status, 9.0).statements[0]["code"] == "camera.process-silent"
    status.values.update(size=(640, 480), identity={"address": "v4l2:///dev/video0", "serial": "7"})
    other = calibration_mismatch(status, None, ImageSize(320, 240))
    assert other["statements"]["what"] == [
        {"code": "camera.other-size", "values": {"size": "640 × 480 px", "wanted": "320 × 240 px"}}
    ]
    mismatch = calibration_mismatch(status, Identity("v4l2:///dev/video0"), ImageSize(640, 480))
    [said] = mismatch["statements"]["what"]
    assert said["values"]["difference"] == {
        "code": "camera-differs.serial",
        "values": {"now": "7", "before": {"code": "camera-differs.unknown", "values": {}}},
    }


def test_advice_names_zones_by_code():
    advice = light.advice(light.Light(120.0, 255.0, 0.0, 0.1, 1.0, (None,) * 9, (0.9, *(0.0,) * 8)))
    [said] = advice[0]["statements"]["text"]
    assert said["values"] == {"zones": [{"code": "zone.top-left", "values": {}}], "share": "10 %"}
    assert [name.statements[0]["code"] for name in zone_names((3, 7))] == [
        "zone.left",
        "zone.bottom",
    ]


def test_what_was_not_saved_and_why_are_stated(tmp_path):
    with pytest.raises(Unavailable) as refused, translate_disk_errors("The calibration"):
        raise OSError(13, "Permission denied")
    assert str(refused.value.what) == "The calibration was not saved: Permission denied."
    first, second = refused.value.what.statements
    assert first == {
        "code": "saved.not",
        "values": {"what": {"code": "saved.calibration", "values": {}}},
    }
    assert second == {"code": "disk.cause", "values": {"error": "Permission denied"}}
    [warning] = PictureQuota(tmp_path, free=lambda _: 50_000_000).warnings()
    assert [one["code"] for one in warning.text.statements] == [
        "disk.nearly-full",
        "disk.images-refused",
    ]


def test_a_refused_file_is_named_by_code():
    with pytest.raises(BadInput) as refused:
        screen(b"GIF89a")
    assert refused.value.what == "This file is a GIF image, which is not supported."
    assert refused.value.what.statements[0]["values"] == {
        "kind": {"code": "file-kind.gif", "values": {}}
    }


def test_a_job_states_its_message_and_the_part_that_it_is_about():
    told = []
    part = subprogress(
        lambda share, message: told.append(message),
        0.0,
        0.5,
        say("pair", "{a} and {b}:", a="A", b="B"),
    )
    part(1.0, "Comparing")
    assert told == ["A and B: Comparing"]
    assert isinstance(told[0], Sentence)
    job = Job("1", "compare", "2026-01-01T00:00:00Z", message=told[0]).to_json()
    assert job["statements"]["message"] == [
        {"code": "pair", "values": {"a": "A", "b": "B"}},
        {"text": "Comparing"},
    ]
    assert Job("1", "compare", "").to_json()["statements"]["message"][0]["code"] == "job.waiting"
