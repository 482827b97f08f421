"""Peers for the benchmark of boards: OpenCV's calibrateCamera, and mrcal's command line where it is installed."""

import ast
import shutil
import subprocess
import tempfile
import time
from pathlib import Path

import cv2
import numpy as np

from touchline.boards.board import Board, BoardView
from touchline.core.geometry import ImageSize
from touchline.models.intrinsics import Intrinsics

MRCAL = shutil.which("mrcal-calibrate-cameras")


def opencv(views: tuple[BoardView, ...], size: ImageSize) -> tuple[Intrinsics, float, float]:
    """The lens with five terms, the rms, and the seconds."""
    places = [v.places_mm.astype(np.float32) for v in views]
    pixels = [v.pixels.astype(np.float32)[:, None] for v in views]
    start = time.perf_counter()
    rms, k, d, _, _ = cv2.calibrateCamera(places, pixels, tuple(size), None, None)
    seconds = time.perf_counter() - start
    terms = (*(float(v) for v in d.ravel()[:5]), 0.0, 0.0, 0.0)
    return (
        Intrinsics(
            "brown-conrady",
            terms,
            float(k[0, 0]),
            float(k[1, 1] / k[0, 0]),
            (float(k[0, 2]), float(k[1, 2])),
            size,
        ),
        float(rms),
        seconds,
    )


def mrcal(
    views: tuple[BoardView, ...],
    board: Board,
    size: ImageSize,
    focal_px: float,
) -> tuple[Intrinsics, float] | None:
    """mrcal's lens with five terms from the same corners, and the seconds its command took; None where it is absent."""
    if MRCAL is None:
        return None
    with tempfile.TemporaryDirectory() as name:
        folder, rows = Path(name), ["# filename x y level"]
        for i, view in enumerate(views):
            found = {
                tuple(p): q
                for p, q in zip(
                    np.rint(view.places_mm[:, :2] / board.square_mm).astype(int).tolist(),
                    view.pixels.tolist(),
                    strict=True,
                )
            }
            for y in range(board.rows):
                for x in range(board.columns):
                    px, py, level = (*found[x, y], "0") if (x, y) in found else (0, 0, "-")
                    rows.append(f"cam-{i:04d}.png {px} {py} {level}")
        (folder / "corners.vnl").write_text("\n".join(rows) + "\n")
        start = time.perf_counter()
        subprocess.run(
            [
                MRCAL,
                "--corners-cache",
                "corners.vnl",
                "--lensmodel",
                "LENSMODEL_OPENCV5",
                "--focal",
                str(focal_px),
                "--imagersize",
                str(size.width),
                str(size.height),
                "--object-spacing",
                str(board.square_mm / 1000),
                "--object-width-n",
                str(board.columns),
                "--object-height-n",
                str(board.rows),
                "--outdir",
                ".",
                "cam-*.png",
            ],
            cwd=folder,
            check=True,
            capture_output=True,
        )
        seconds = time.perf_counter() - start
        text = "\n".join(
            line
            for line in next(folder.glob("*.cameramodel")).read_text().splitlines()
            if not line.strip().startswith("#")
        )
    numbers = text[text.index("[", text.index("'intrinsics'")) :]
    fx, fy, cx, cy, *terms = ast.literal_eval(numbers[: numbers.index("]") + 1])
    return Intrinsics(
        "brown-conrady", (*terms, *[0.0] * (8 - len(terms))), fx, fy / fx, (cx, cy), size
    ), seconds
