"""Writes the golden files: what our own code exported of the models' examples on 2026-11-21, for tests to hold it to.

    python tests/golden/make.py [MODEL …]

Every example of every model in every format that holds it exactly (of tables of points the first, for their size). A
difference from them is a change of what others read: make them anew only when that is meant. Tables for pictures (npz)
are too large to be kept, and are held against the model itself.
"""

import sys
from pathlib import Path

HERE = Path(__file__).parent
sys.path.insert(0, str(HERE.parents[1]))

from tests.support.exported import EXAMPLES, LENS_FORMATS, example, model_of  # noqa: E402
from touchline.formats import FORMATS  # noqa: E402
from touchline.formats.approximation import exact_camera  # noqa: E402
from touchline.workflows import interchange  # noqa: E402


def cases() -> list[tuple[str, str, int]]:
    """(format, model, index) of every golden file."""
    held = [
        (f, name, i)
        for f in LENS_FORMATS
        for name, i in EXAMPLES
        if exact_camera(model_of(name, i), FORMATS[f].lenses, FORMATS[f].square_pixels) is not None
    ]
    return [
        *(("json", name, i) for name, i in EXAMPLES),
        *(("csv", name, i) for name, i in EXAMPLES if i == 0),
        ("vision-processor-start", "brown-conrady", 0),
        *held,
    ]


def path(format: str, name: str, index: int) -> Path:
    return HERE / format / f"{name}-{index}{FORMATS[format].suffix}"


if __name__ == "__main__":
    wanted = [case for case in cases() if case[1] in (sys.argv[1:] or case)]
    for case in wanted:
        path(*case).parent.mkdir(exist_ok=True)
        path(*case).write_bytes(interchange.export(example(*case[1:]), case[0]).data)
    print(f"{len(wanted)} files")
