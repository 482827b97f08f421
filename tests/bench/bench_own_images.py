"""Does a rig whose cameras hang alike tell exchanged cables and a doubled stream, and leave an honest one alone?

    PYTHONPATH=.:tests python tests/bench/bench_own_images.py

Each pair of cameras of rigs of two and four, by both simulators; pictures of later moments: robots have moved. A
stream is sent twice: once half as large, darker, JPEG 60, 0.3 s later.
"""

from collections import Counter
from dataclasses import replace
from itertools import combinations

import cv2

from tests.support.live_cameras import FIELDS
from tests.support.second_simulator.render import render
from tests.support.second_simulator.scene_spec import scene_spec
from tests.support.simulated_source import simulated_source
from touchline.core.geometry import ImageSize
from touchline.evaluate.site_claims import CameraImage, compare
from touchline.vision.picture_print import PicturePrint

RIG = "sim://{}?cameras={}&camera={}&size=1280x1024&fps=240&play=field&{}"
SCENES = {
    "empty": "robots=0&tilt=3",
    "12 robots": "robots=12&tilt=3",
    "22 robots, 2 people": "robots=22&people=2&tilt=3",
    "plain carpet": "robots=0&tilt=3&grain=0&glare=0&vignette=0&noise=4",
    "plain carpet, 12 robots, light ± 50 %": "robots=12&tilt=3&grain=0&glare=0&noise=4&drift=0.5",
}
MOMENTS_S = (60, 300, 900)
LATE_S = 0.3
SIZE = ImageSize(1280, 1024)
CASES = {
    "own images": {"apart"},
    "exchanged": {"first", "second"},
    "exchanged, one without its image": {"first", "second"},
    "one stream, versions of two": {"image", "first", "second"},
    "one stream, versions of one": {"image"},
    "one stream, no versions": {"image"},
}


def printed(picture):
    made = PicturePrint.of(picture)
    assert made is not None
    return made


def sent(picture):
    small = cv2.resize(picture, None, fx=0.5, fy=0.5, interpolation=cv2.INTER_AREA)
    dark = cv2.convertScaleAbs(small, alpha=0.8, beta=5)
    return cv2.imdecode(
        cv2.imencode(".jpg", dark, [cv2.IMWRITE_JPEG_QUALITY, 60])[1], cv2.IMREAD_COLOR
    )


def simulated(field, count, scene):
    """Per camera: prints of its picture as it is and as sent, when it was calibrated and at each moment after that."""
    for number in range(count):
        one = simulated_source(RIG.format(field, count, number, scene), FIELDS).rendering
        yield [
            (
                printed(one.frame_at(10 * second + number, float(second))),
                printed(sent(one.frame_at(10 * second + 40 + number, second + LATE_S))),
            )
            for second in (0, *MOMENTS_S)
        ]


def second_simulator(seed):
    """The same of the two halves of a field: same lens and mount, other things and light at each moment."""
    spec = replace(
        scene_spec(seed, field="ssl-div-b", region="half-left", size=(1280, 1024)), seed=seed
    )
    for half in ("half-left", "half-right"):
        pictures = [render(replace(spec, region=half), moment=moment).pixels for moment in (0, 1)]
        yield [(printed(picture), printed(sent(picture))) for picture in pictures]


def count(counted, rig):
    """Add what is told of each pair of a rig's cameras in each case."""
    for (number, one), (_, other) in combinations(enumerate(rig), 2):
        for (now, again), (others, _) in zip(one[1:], other[1:], strict=True):
            a = CameraImage("", now, one[0][0], SIZE, ("hall", number))
            b = CameraImage("", others, other[0][0], SIZE, ("hall", "other"))
            cases = (
                (a, b),
                (replace(a, now=others), replace(b, now=now)),
                (replace(a, now=others, then=None), replace(b, now=now)),
                (a, replace(b, now=again)),
                (a, replace(b, now=again, then=one[0][1])),
                (replace(a, then=None, size=None), replace(b, now=again, then=None, size=None)),
            )
            for case, pair in zip(CASES, cases, strict=True):
                counted[case][compare(*pair)] += 1


def judge(title, rigs):
    counted = {case: Counter() for case in CASES}
    for rig in rigs:
        count(counted, list(rig))
    for case, right in CASES.items():
        every = counted[case]
        print(
            f"{title}: {case}: {sum(every[found] for found in right)} of {every.total()} told; {dict(every)}",
            flush=True,
        )


if __name__ == "__main__":
    for name, scene in SCENES.items():
        judge(
            name,
            (
                simulated(field, cameras, scene)
                for cameras in (2, 4)
                for field in ("ssl-div-b", "ssl-div-a")
            ),
        )
    judge("second simulator", map(second_simulator, range(6)))
