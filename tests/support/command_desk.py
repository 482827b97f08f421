"""A folder with what the commands of the shell read: pictures, points, boards, matches, calibrations, a film."""

import json
from pathlib import Path

import cv2
import numpy as np

from tests.support import folder_pictures, pair_over_field
from tests.support.bar_pictures import BENT, bars_behind
from tests.support.board_views import picture_of
from tests.support.rolling_balls import FPS, SIZE, film, lens_of
from touchline.boards.board import Board
from touchline.formats import FORMATS
from touchline.store.store import Store

BOARD = Board("chessboard", 9, 6, 25.0)


def laid_out(folder: Path) -> Path:
    """Write all of it into a folder, and return that."""
    folder_pictures.folder_of(folder / "pictures", 1)
    cv2.imwrite(str(folder / "bars.png"), bars_behind(BENT))
    rng = np.random.default_rng(0)
    for number in range(5):
        turn = rng.uniform(-0.3, 0.3)
        c, s = 2.6 * np.cos(turn), 2.6 * np.sin(turn)
        board_from_mm = np.array(
            [
                [c, -s, 180 + rng.uniform(0, 100)],
                [s, c, 180 + rng.uniform(0, 60)],
                [*rng.uniform(-6e-4, 6e-4, 2), 1],
            ]
        )
        cv2.imwrite(str(folder / f"board{number}.png"), picture_of(BOARD, board_from_mm))
    left, right = pair_over_field.matches()
    (folder / "matches.json").write_text(json.dumps({"points_a": left, "points_b": right}))
    (folder / "rows.json").write_text(
        json.dumps([[*a, *b] for a, b in zip(left, right, strict=True)])
    )
    for name, calibration in zip(("left", "right"), pair_over_field.calibrations(), strict=True):
        (folder / f"{name}.json").write_bytes(FORMATS["json"].write(calibration))
    writer = cv2.VideoWriter(
        str(folder / "film.avi"), cv2.VideoWriter.fourcc(*"MJPG"), FPS, tuple(SIZE)
    )
    for _, pixels in film(lens_of(-0.25), [((60, 60), (560, 90), 30), ((80, 420), (560, 300), 30)]):
        writer.write(pixels)
    writer.release()
    (folder / "empty").mkdir()
    with Store(folder / "kept") as store:  # which backs up what it has saved
        store.calibrations.add(pair_over_field.calibrations()[0])
    return folder
