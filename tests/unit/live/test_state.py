"""How a camera is, by the last status of its process: silent, without frames, frozen, or not the calibrated one."""

import pytest

from touchline.core.geometry import ImageSize
from touchline.live.supervisor import (
    FROZEN_CODED_S,
    FROZEN_S,
    INTERVALS,
    LONG_S,
    OPEN_S,
    SHARE_IN_DOUBT,
    STALL_S,
    UNKNOWN_S,
    ProcessStatus,
    calibration_mismatch,
    frozen_doubt,
    frozen_reason,
    stall_reason,
    unmonitored,
)
from touchline.sources import Identity

NORTH = Identity("rtsp://10.0.0.4/live")


def reported(**values) -> ProcessStatus:
    """What a camera's process has said at 0 s; unless told, live with 25 frames a second, the last one just now."""
    usual = {
        "state": "live",
        "interval_s": 0.04,
        "age_s": 0.0,
        "size": [640, 480],
        "identity": NORTH.to_json(),
    }
    return ProcessStatus.initial(0.0).updated({**usual, **values}, 0.0)


@pytest.mark.parametrize(
    ("values", "after_s", "code"),
    [
        ({}, STALL_S - 0.1, None),
        ({}, STALL_S + 0.1, "camera.process-silent"),
        ({"age_s": STALL_S - 0.2}, 0.1, None),
        ({"age_s": STALL_S}, 0.1, "camera.no-frame"),
        ({"interval_s": 1.25, "age_s": INTERVALS * 1.25 - 0.2}, 0.1, None),  # a slow camera
        ({"interval_s": 1.25, "age_s": INTERVALS * 1.25}, 0.1, "camera.no-frame"),
        (
            {"interval_s": 0.0, "age_s": UNKNOWN_S - 0.2},
            0.1,
            None,
        ),  # of which only one frame came yet
        ({"interval_s": 0.0, "age_s": UNKNOWN_S}, 0.1, "camera.no-frame"),
        ({"state": "connecting", "age_s": None, "since_s": OPEN_S - 0.2}, 0.1, None),
        ({"state": "connecting", "age_s": None, "since_s": OPEN_S}, 0.1, "camera.no-response"),
        ({"state": "connecting", "age_s": None}, UNKNOWN_S - 0.1, None),
        ({"state": "connecting", "age_s": None}, UNKNOWN_S + 0.1, "camera.process-silent"),
        ({"state": "offline", "age_s": 60.0}, 0.1, None),
    ],
)  # and it says so itself
def test_a_camera_is_stalled_when_it_is_silent_for_longer_than_its_own_pace_explains(
    values, after_s, code
):
    why = stall_reason(reported(**values), after_s)
    assert (None if why is None else why.statements[0]["code"]) == code
    assert stall_reason(reported(**values), after_s, grace_s=0.5) is None


def still(all_s=0.0, most_s=0.0, share=0.0, had_noise=True):
    return reported(
        quality={
            "still": {"all_s": all_s, "most_s": most_s, "share": share, "had_noise": had_noise}
        }
    )


@pytest.mark.parametrize(
    ("scheme", "values", "frozen"),
    [
        ("http", {"all_s": FROZEN_S - 0.1}, False),
        ("http", {"all_s": FROZEN_S + 0.1}, True),
        # up to the next key frame
        ("rtsp", {"all_s": LONG_S}, False),
        ("rtsp", {"all_s": FROZEN_CODED_S}, True),
        ("picture", {"all_s": 60.0}, False),
        ("sim", {"all_s": 60.0}, False),
        # under a running clock
        ("v4l2", {"most_s": LONG_S + 0.1}, True),
        ("v4l2", {"most_s": LONG_S - 0.1}, False),
        ("v4l2", {"most_s": 60.0, "had_noise": False}, False),
        ("v4l2", {"most_s": None}, False),
        ("rtsp", {"most_s": 60.0}, False),
        ("video", {"most_s": 60.0}, False),
    ],
)
def test_a_picture_that_stays_the_same_is_frozen_except_where_it_may_stand_still(
    scheme, values, frozen
):
    assert (frozen_reason(still(**values), scheme) is not None) == frozen
    assert frozen_reason(reported(), scheme) is None  # nobody has looked yet


@pytest.mark.parametrize(
    ("scheme", "share", "is_doubted"),
    [
        ("rtsp", SHARE_IN_DOUBT + 0.01, True),
        ("rtsp", SHARE_IN_DOUBT - 0.01, False),
        ("http", 1.0, True),
        ("sim", 1.0, False),
        ("picture", 1.0, False),
    ],
)
def test_no_movement_is_claimed_where_a_frozen_picture_would_look_the_same(
    scheme, share, is_doubted
):
    doubt = frozen_doubt(still(share=share), scheme)
    assert (doubt is not None) is is_doubted and frozen_doubt(reported(), scheme) is None
    steady = {
        "state": "steady",
        "alarm": False,
        "monitored": True,
        "px": 0.0,
        "mm": 0.0,
        "fix": "",
        "statements": {},
    }
    if doubt is not None:
        told = unmonitored(steady, doubt)
        assert (told["state"], told["monitored"], told["px"], told["sentence"]) == (
            "unfollowed",
            False,
            None,
            doubt,
        )
        assert told["fix"] and told["statements"]["sentence"]
        knocked = unmonitored({**steady, "state": "knocked", "alarm": True, "px": 3.0}, doubt)
        assert (knocked["state"], knocked["px"], knocked["monitored"]) == ("knocked", 3.0, False)


@pytest.mark.parametrize(
    ("values", "confirmed", "size", "reason"),
    [
        ({}, NORTH, ImageSize(640, 480), None),
        ({}, NORTH, ImageSize(320, 240), "other-size"),
        ({}, Identity("rtsp://10.0.0.5/live"), ImageSize(640, 480), "other-camera"),
        ({}, None, ImageSize(640, 480), None),  # nobody knows which one it was
        ({}, Identity("rtsp://10.0.0.5/live"), None, None),  # it is not calibrated
        # it has not said yet what it is
        ({"size": None, "identity": None}, NORTH, ImageSize(320, 240), None),
    ],
)
def test_a_calibration_of_another_size_or_camera_is_named_with_what_to_do(
    values, confirmed, size, reason
):
    problem = calibration_mismatch(reported(**values), confirmed, size)
    assert (problem and problem["reason"]) == reason and (problem is None or problem["fix"])
