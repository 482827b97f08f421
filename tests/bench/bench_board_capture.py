"""What looking for a board costs a live stream. Command: python -m pytest tests/bench/bench_board_capture.py -s

One viewer counts the frames of a camera that shows a board, in turns with and without somebody who holds a board before
it; the order is changed in each round, since other work on the machine comes and goes.
"""

import json
import statistics
import sys
import threading
import time
from pathlib import Path

import pytest
from websockets.sync.client import connect

sys.path.insert(0, str(Path(__file__).parents[2]))

from tests.support.board_film import BOARD, film
from tests.support.servers import served

ROUNDS, SECONDS = 5, 8.0
MIN_SHARE = 0.95  # of the frames without


@pytest.fixture
def camera(tmp_path):
    """The WebSocket address of a camera that gives 30 frames of a held board a second."""
    film(tmp_path / "board.avi", 4)
    (tmp_path / "settings.yaml").write_text(f"pictures: {tmp_path}\ncameras:\n"
                                            "- {id: held, source: 'video://board.avi?fps=30'}\n")
    with served(tmp_path / "data", "--config", str(tmp_path / "settings.yaml")) as url:
        yield url.replace("http", "ws") + "/api/v1/cameras/held"


def frames_a_second(camera: str) -> float:
    with connect(f"{camera}/stream?width=640") as stream:
        stream.recv(timeout=60)
        count, end = 0, time.monotonic() + SECONDS
        while time.monotonic() < end:
            stream.recv(timeout=10)
            count += 1
    return count / SECONDS


def looking(camera: str, end: threading.Event, looks: list[float]) -> None:
    with connect(f"{camera}/board") as line:
        line.send(json.dumps({"board": BOARD.to_json(), "automatic": False}))
        while not end.is_set():
            line.recv(timeout=30)
            looks.append(time.monotonic())


def test_looking_for_a_board_costs_a_stream_less_than_a_twentieth(camera):
    frames_a_second(camera)  # until all is awake
    alone, beside, rates = [], [], []
    for turn in range(ROUNDS):
        for with_board in ((False, True), (True, False))[turn % 2]:
            if not with_board:
                alone.append(frames_a_second(camera))
                continue
            end, looks = threading.Event(), []
            other = threading.Thread(target=looking, args=(camera, end, looks))
            other.start()
            beside.append(frames_a_second(camera))
            end.set()
            other.join()
            rates.append((len(looks) - 1) / (looks[-1] - looks[0]))
    share = statistics.median(beside) / statistics.median(alone)
    print(f"\nalone {statistics.median(alone):.2f}, beside a board {statistics.median(beside):.2f} frames/s: "
          f"{100 * share:.1f} %; {statistics.median(rates):.1f} looks/s; alone {alone}, beside {beside}")
    assert share >= MIN_SHARE and statistics.median(rates) <= 5.2
