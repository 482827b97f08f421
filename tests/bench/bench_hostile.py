"""Every shape of a calibration file that the tests know, mutated at random: read, or refused with a cure. Command:

    python tests/bench/bench_hostile.py [MUTATIONS [PROCESSES]]

MUTATIONS, 5000 without it, of each shape: bytes cut out, doubled, exchanged for others, for scraps that parsers stumble
over and for pieces of other shapes. It fails where a reader raises anything but a refusal of ours, and prints the
slowest.
"""

import random
import sys
import time
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path

ROOT = Path(__file__).parents[2]
sys.path[:0] = [str(ROOT)]

from tests.support.exported import READABLE  # noqa: E402
from tests.unit.formats import test_league_files as league  # noqa: E402
from tests.unit.formats import test_other_lenses as lenses  # noqa: E402
from tests.unit.formats import test_shapes as shapes  # noqa: E402
from tests.unit.formats.test_imports_hostile import SCRAPS, written  # noqa: E402
from touchline.core.errors import TouchlineError  # noqa: E402
from touchline.core.geometry import ImageSize  # noqa: E402
from touchline.fields.routes import parsed_field  # noqa: E402
from touchline.store.fields import load_fields  # noqa: E402
from touchline.workflows import interchange  # noqa: E402

MAX_BYTES = 1 << 19  # larger shapes, with pictures, are only slow
OPTIONS = [
    interchange.ImportOptions(),
    interchange.ImportOptions(entry="1", model="fisheye"),
    interchange.ImportOptions(field="ssl-div-b", image_size=ImageSize(1280, 960)),
]


def files() -> dict[str, bytes]:
    """Return the shapes by name."""
    found = {name: shapes.as_bytes(shape[0]) for name, shape in shapes.SHAPES.items()}
    found |= {name: lens[0].encode() for name, lens in lenses.LENSES.items()}
    found |= {f"written: {name}": written(name) for name in READABLE}
    found |= {
        "ssl-vision's settings": league.settings(league.SSL, league.OPENCV, sign=","),
        "vision-processor geometry": (league.GEOMETRY + league.CALIB).encode(),
        "vision-processor config": league.CONFIG.encode(),
    }
    return {name: data for name, data in found.items() if len(data) <= MAX_BYTES}


def mutated(data: bytes, others: list[bytes], rng: random.Random) -> bytes:
    text = bytearray(data)
    for _ in range(rng.randint(1, 4)):
        start = rng.randint(0, len(text))
        end = min(len(text), start + rng.choice((0, 1, 2, 8, 40, 400)))
        other = rng.choice(others)
        piece = rng.randint(0, len(other))
        text[start:end] = rng.choice(
            (
                b"",
                bytes(text[start:end]) * 2,
                rng.randbytes(rng.randint(1, 6)),
                rng.choice(SCRAPS),
                other[piece : piece + 60],
                str(rng.choice((-1, 0, 1e9, 0.5, 7))).encode(),
            )
        )
    return bytes(text)


def tried(name: str, mutations: int) -> tuple[str, int, int, float]:
    """Return the shape, how many mutations were read, how many raised what is no refusal, and the slowest, s."""
    shapes_now = files()
    others, fields = [*shapes_now.values()], load_fields()
    rng = random.Random(name)
    read = wrong = 0
    slowest_s = 0.0
    for i in range(mutations):
        data = mutated(shapes_now[name], others, rng)
        options = OPTIONS[i % len(OPTIONS)]
        began = time.process_time()
        try:
            found = interchange.read_file(data, options)
            if interchange.is_lens(found):
                interchange.lens_record_from_file(found, options)
            elif not isinstance(found, interchange.Calibration):
                interchange.calibration_from_file(found, options, fields)
            read += 1
        except TouchlineError as refused:
            wrong += not (refused.what and refused.fix and refused.status < 500)
        except Exception as error:
            wrong += 1
            print(f"{name}: {type(error).__name__}: {error}\n{data!r}"[:3000], flush=True)
        slowest_s = max(slowest_s, time.process_time() - began)
        if b"field" in data or b"VarXML" in data:
            try:
                parsed_field(data, fields.values())
            except TouchlineError:
                pass
            except Exception as error:
                wrong += 1
                print(
                    f"{name}, field: {type(error).__name__}: {error}\n{data!r}"[:3000], flush=True
                )
    return name, read, wrong, slowest_s


if __name__ == "__main__":
    mutations = int(sys.argv[1]) if len(sys.argv) > 1 else 5000
    processes = int(sys.argv[2]) if len(sys.argv) > 2 else 2
    names = [*files()]
    with ProcessPoolExecutor(processes) as pool:
        rows = [*pool.map(tried, names, [mutations] * len(names))]
    for name, read, _, slowest_s in sorted(rows, key=lambda row: -row[3])[:8]:
        print(f"{name:36} {read:6} read, slowest {slowest_s * 1000:5.0f} ms")
    wrong = sum(row[2] for row in rows)
    print(
        f"{len(rows)} shapes × {mutations} mutations: {sum(row[1] for row in rows)} read, "
        f"{wrong} neither read nor refused, slowest {max(row[3] for row in rows) * 1000:.0f} ms"
    )
    sys.exit(bool(wrong))
