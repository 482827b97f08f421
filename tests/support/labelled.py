"""Pictures of real fields with what a person saw in them, and how much of that the stages find.

tests/labels/*.yaml name pictures by path beside the project and by the first 16 digits of their SHA-256; places are raw
px, read by eye from enlarged pictures to about a pixel. `learn`: where somebody clicks, at most five times a colour.
`ignore`: x, y, radius, of what is neither right nor wrong, such as a paler patch of a team's colour. Nothing
is looked for outside `field`.
"""

import hashlib
from dataclasses import dataclass, field
from pathlib import Path

import cv2
import numpy as np
import yaml

from tests.support.paths import LABELS
from tests.support.paths import SHARED_DATA as DATA
from touchline.core.geometry import ImageSize
from touchline.detection.colours import BACKGROUND, learn_profile
from touchline.detection.records import FieldLocator
from touchline.detection.stages import StageConfig, StageContext, StagePipeline
from touchline.detection.store import load_plans

SETS = sorted(LABELS.glob("*.yaml"))
COLOURS = ("orange", "yellow", "blue", "pink", "green", "cyan", "purple", "red", BACKGROUND)


@dataclass
class Tally:
    """Of one kind of thing: found where it is, not found, found where it is not; and how far off."""

    hit: int = 0
    missed: int = 0
    false: int = 0
    off_px: list = field(default_factory=list)

    @property
    def recall(self):
        return self.hit / max(1, self.hit + self.missed)

    @property
    def precision(self):
        return self.hit / max(1, self.hit + self.false)


def read_set(path: Path) -> dict:
    return yaml.safe_load(path.read_text())


def there(labels: dict) -> bool:
    return all(
        (DATA / entry["picture"]).is_file() for part in ("learn", "test") for entry in labels[part]
    )


def picture(entry: dict) -> np.ndarray:
    path = DATA / entry["picture"]
    assert hashlib.sha256(path.read_bytes()).hexdigest()[:16] == entry["sha256"], (
        f"{path.name} is another picture"
    )
    if "frame" not in entry:
        still = cv2.imread(str(path))
        assert still is not None
        return still
    film = cv2.VideoCapture(str(path))
    for _ in range(entry["frame"] + 1):
        ok, pixels = film.read()
        assert ok
    return pixels


def sight_for(labels: dict) -> StagePipeline:
    clicks = [
        (picture(e), {c: [tuple(p) for p in e[c]] for c in COLOURS if c in e})
        for e in labels["learn"]
    ]
    profile = learn_profile("labelled", clicks)
    size = ImageSize(*picture(labels["test"][0]).shape[1::-1])
    within = np.zeros((size.height, size.width), np.uint8)
    cv2.fillPoly(within, [np.array(labels["field"]).round().astype(np.int32)], 255)
    plan = load_plans()["mirosot"].to_json()
    for stage in plan["stages"]:
        if stage["stage"] == "colours":
            stage["everywhere"] = ["orange", *labels["teams"]]
        if stage["stage"] == "markers":
            stage |= {
                "teams": list(labels["teams"]),
                "most_mm2": labels.get("most_mm2", stage["most_mm2"]),
            }
    locator = FieldLocator.flat(size, labels["mm_per_px"])
    return StagePipeline(
        StageConfig.from_json(plan),
        StageContext(size, profile, locator, 60.0, labels["ball_radius_mm"], within),
    )


def tallies(labels: dict) -> dict[str, Tally]:
    """By "ball" and each team's colour, over all frames that are tested."""
    kinds = {"ball": "orange"} | (
        {} if labels.get("only_ball") else {team: team for team in labels["teams"]}
    )
    found = {kind: Tally() for kind in kinds}
    sight = sight_for(labels)
    for entry in labels["test"]:
        pixels = picture(entry)
        # knows no frame before it
        seen = StagePipeline(sight.config, sight.context).process(pixels).detections.items
        for kind, colour in kinds.items():
            told = [
                d.pixel
                for d in seen
                if (d.kind == "ball") == (kind == "ball") and d.team in (kind, None)
            ]
            _match(
                found[kind],
                told,
                entry.get(colour, []),
                labels["match_px"],
                entry.get("ignore", []),
            )
    return found


def _match(tally: Tally, told: list, true: list, reach_px: float, ignored: list) -> None:
    told = list(told)
    for x, y in true:
        near = min(told, key=lambda p: np.hypot(p[0] - x, p[1] - y), default=None)
        if near is None or np.hypot(near[0] - x, near[1] - y) > reach_px:
            tally.missed += 1
            continue
        told.remove(near)
        tally.hit += 1
        tally.off_px.append(float(np.hypot(near[0] - x, near[1] - y)))
    tally.false += sum(all(np.hypot(px - x, py - y) > r for x, y, r in ignored) for px, py in told)
