"""WS /cameras/{id}/board: a board before a live camera is seen, told about, and taken by itself."""

import json
from contextlib import contextmanager

import pytest
from starlette.testclient import TestClient

from tests.support.board_film import BOARD, SIZE, film
from tests.support.refusals import API
from tests.support.waiting import receive_until
from touchline.main import create_app
from touchline.settings import Settings

LONG_S = 90.0  # a loaded machine starts a camera's process slowly


@pytest.fixture(scope="module")
def films(tmp_path_factory):
    """A server whose camera shows a film of a board in two poses, again and again; and one that shows none."""
    folder = tmp_path_factory.mktemp("films")
    film(folder / "board.avi", 2)
    settings = Settings(
        data=folder / "data",
        pictures=folder,
        cameras=[
            {"id": "held", "source": "video://board.avi"},
            {"id": "bare", "source": "sim://table?size=320x256&fps=20"},
        ],
    )
    with TestClient(create_app(settings), base_url="http://127.0.0.1:8000") as client:
        yield client


def socket_to(client, camera):
    return client.websocket_connect(
        f"{API}/cameras/{camera}/board", headers={"host": "127.0.0.1:8000"}
    )


@contextmanager
def listening(client, camera, **first):
    with socket_to(client, camera) as line:
        line.send_text(json.dumps({"board": BOARD.to_json(), **first}))
        yield line


def test_a_board_that_is_held_still_is_taken_by_itself_once_in_each_pose(films):
    with listening(films, "held") as line:
        taken = [receive_until(line, lambda told: told["taken"])[-1] for _ in range(2)]
        for number, told in enumerate(taken, 1):
            kept = films.get(f"{API}/snapshots/{told['taken']['id']}").json()
            assert (kept["camera"], kept["width"], kept["height"]) == ("held", *SIZE)
            assert told["count"] == number and len(told["corners"]) == 54 and len(told["quad"]) == 4
        assert sum(map(sum, taken[-1]["cells"])) == 2 * 54 and taken[-1]["wanted"][
            "text"
        ].startswith("Hold the board")
        again = receive_until(line, lambda told: told["still"] and not told["new"])[-1]
        assert "already" in again["hint"] and again["taken"] is None and again["count"] == 2
    assert len(films.get(f"{API}/snapshots?purpose=board").json()["items"]) == 2
    assert films.get(f"{API}/snapshots?purpose=picture").json()["items"] == []


def test_what_was_taken_before_is_not_taken_again_and_by_hand_it_is(films):
    with listening(films, "held", automatic=False) as line:
        seen = receive_until(line, lambda told: told["still"] and told["new"])[-1]
        assert seen["taken"] is None and not seen["automatic"]
    with listening(films, "held", automatic=False, taken=[seen["quad"]]) as line:
        assert line.receive_json()["count"] == 1
        line.send_text(json.dumps({"take": True}))
        assert receive_until(line, lambda told: told["taken"])[-1]["count"] == 2
        line.send_text(json.dumps({"automatic": True}))
        assert receive_until(line, lambda told: told["automatic"])[-1]


def test_a_camera_before_which_there_is_no_board_says_so(films):
    with listening(films, "bare") as line:
        told = line.receive_json()
    assert (
        told["quad"] is None
        and told["corners"] == []
        and told["hint"].startswith("No board detected")
    )
    assert told["wanted"]["outline"] and told["count"] == 0


@pytest.mark.parametrize(
    "first",
    [
        b"\xff\x00",
        "",
        "[" * 50_000,
        "x" * 200_000,
        "no JSON",
        "{}",
        '{"board": {"kind": "cube"}}',
        "[1]",
        "null",
        json.dumps({"board": BOARD.to_json(), "taken": [[1]]}),
        json.dumps({"board": BOARD.to_json(), "taken": [[[0, 0]] * 4]}),
    ],
)
def test_nonsense_is_refused_in_a_sentence_and_the_line_is_closed(films, first):
    with socket_to(films, "bare") as line:
        line.send_bytes(first) if isinstance(first, bytes) else line.send_text(first)
        problem = line.receive_json()
        assert problem["status"] == 422 and problem["fix"]


def test_a_camera_that_is_not_there_and_a_third_who_watches_are_refused(films):
    with socket_to(films, "none") as line:
        assert line.receive_json()["status"] == 404
    with listening(films, "bare") as one, listening(films, "bare") as two:
        for line in (one, two):
            line.receive_json()
        with socket_to(films, "bare") as third:
            problem = third.receive_json()
        assert problem["type"].endswith("board-watched") and problem["fix"]
