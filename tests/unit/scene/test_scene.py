"""viser on this machine alone: who has no key is nobody, and whoever asks for a tunnel gets none; what a room draws."""

import re

import msgspec
import numpy as np
import pytest
import viser
from websockets.exceptions import InvalidStatus
from websockets.sync.client import connect

from tests.support.pair_over_field import FIELD
from tests.support.rig_over_field import sim_task
from touchline.core.errors import BadInput
from touchline.core.geometry import ImageSize
from touchline.detection.records import Detection, Detections
from touchline.scene.live import LAYERS, SceneView, SecuredViser, ViewState
from touchline.scene.messages import KEY_HEADER
from touchline.scene.service import whole_page

KEY = "the-key-of-this-scene"
PROTOCOL = f"viser-v{viser.__version__}"


@pytest.fixture(scope="module")
def locked():
    server = SecuredViser(KEY)
    yield server
    server.stop()


@pytest.fixture(scope="module")
def kept():
    task = sim_task(2, 0)
    return {**task.record(task.run(cross_validate=False)).to_json(), "id": "a" * 16}


def shown(kept, **more):
    return {
        "cameras": [
            {"key": kept["id"], "title": "North", "calibration": kept, "before": None, **more}
        ]
    }


@pytest.fixture
def room(locked):
    clicked = []
    made = SceneView(locked, clicked.append)
    made.clicked = clicked
    return made


def line(server, **headers):
    return connect(
        f"ws://127.0.0.1:{server.get_port()}/",
        subprotocols=[PROTOCOL],
        proxy=None,
        max_size=None,
        additional_headers=headers,
    )


@pytest.mark.parametrize(
    "headers", [{}, {KEY_HEADER: "guessed"}, {KEY_HEADER: ""}, {"Origin": "http://evil.example"}]
)
def test_nobody_comes_in_without_the_key(locked, headers):
    with pytest.raises(InvalidStatus) as refused:
        line(locked, **headers)
    assert refused.value.response.status_code == 403


def test_the_port_serves_no_files(locked):
    import requests

    for path in ("/", "/index.html", "/../../../etc/hostname"):
        assert (
            requests.get(f"http://127.0.0.1:{locked.get_port()}{path}", timeout=10).status_code
            == 403
        )


def test_it_listens_on_this_machine_alone(locked):
    assert locked.get_host() == "127.0.0.1" and locked.get_port() > 0


def test_another_port_cannot_be_forced_on_it(monkeypatch):
    monkeypatch.setenv("_VISER_PORT_OVERRIDE", "1")
    server = SecuredViser(KEY)
    try:
        assert server.get_port() > 1
    finally:
        server.stop()


def test_a_request_to_share_opens_no_tunnel(locked):
    with line(locked, **{KEY_HEADER: KEY}) as viewer:
        viewer.recv(timeout=20)
        viewer.send(msgspec.msgpack.encode({"type": "ShareUrlRequest"}))
        viewer.send(msgspec.msgpack.encode({"type": "ShareUrlDisconnect"}))
        viewer.ping().wait(20)  # it has read them: they came before
    assert locked.request_share_url() is None
    assert locked._share_tunnel is None
    assert not any(
        "Share" in kind.__name__ or "FileTransferStart" in kind.__name__
        for kind in locked._websock_server._incoming_handlers
    )


def test_a_room_tells_what_it_shows_and_refuses_what_is_nothing(room, kept):
    told = room.show(shown(kept))
    assert (
        told["cameras"][0]["height_mm"] > 3000 and told["sheet_top_mm"] > 0 and told["scale"] >= 1
    )
    with pytest.raises(BadInput):
        room.show({"cameras": []})
    assert room._nodes  # the former scene stays


class Click:
    """What viser tells of a click, in metres."""

    def __init__(self, origin, direction):
        self.ray_origin, self.ray_direction = origin, direction


def test_a_click_on_the_carpet_is_told_in_millimetres(room, kept):
    room.show(shown(kept))
    room._clicked(Click((-2.0, 1.0, 5.0), (0.0, 0.0, -1.0)))
    room._clicked(Click((0.0, 0.0, 5.0), (0.0, 0.0, 1.0)))  # into the sky: nothing to tell
    [told] = room.clicked
    assert told["place_mm"] == pytest.approx([-2000, 1000]) and told["cameras"][0]["inside"]


def test_layers_are_seen_or_not_as_asked(room, kept):
    room.show(shown(kept))
    room.set_state({"layers": ["rays"], "sheet": "carpet"})
    camera = room._nodes[kept["id"]]
    assert camera.handles["rays"][0].visible and not camera.handles["labels"][0].visible
    assert not any(
        handle.visible for layer in ("arrows", "moved") for handle in camera.handles[layer]
    )
    assert camera.handles["carpet"][0].visible and not camera.handles["hat"][0].visible
    room.set_state({"hidden": [kept["id"]]})
    assert not camera.handles["rays"][0].visible and not camera.handles["carpet"][0].visible


def test_through_a_camera_its_rays_and_label_are_out_of_the_way_and_lines_lie_over_its_picture(
    room, kept
):
    room.show(shown(kept))
    room.set_state({"layers": list(LAYERS), "view": "camera", "through": kept["id"]})
    camera = room._nodes[kept["id"]]
    assert camera.field_lines.visible and not camera.handles["rays"][0].visible
    assert not camera.handles["labels"][0].visible
    view = room.viewpoint(1.5)
    assert view.position_mm == pytest.approx(camera.camera.frustum.position_mm)


def test_the_picture_of_a_frustum_is_the_straightened_one(room, kept):
    room.show(shown(kept))
    raw = np.full((512, 640, 3), (10, 200, 30), np.uint8)
    room.show_picture(kept["id"], raw)
    picture = room._nodes[kept["id"]]._frustum.image
    middle = picture[picture.shape[0] // 2, picture.shape[1] // 2]
    assert picture.shape[1] <= 480 and middle.tolist() == [30, 200, 10]  # RGB of the BGR that came
    room.show_picture("nobody", raw)  # a camera that was replaced meanwhile


def test_ball_and_robots_stand_where_they_were_detected_and_nowhere_else(room, kept):
    room.show(shown(kept))
    room.set_state({"layers": ["things"]})
    seen = Detections(
        (
            Detection("ball", (1.0, 2.0), x_mm=500.0, y_mm=-250.0),
            Detection("ball", (3.0, 4.0)),
            Detection("robot", (5.0, 6.0), "blue", 3, 0.0, 1000.0, 150.0, 0.5),
            Detection("marker", (7.0, 8.0), "yellow", None, 100.0, 100.0, 150.0),
        ),
        ImageSize(640, 512),
    )
    room.show_detections(kept["id"], seen.to_json()["detections"])
    # of the second ball nobody knows where it is
    ball, robot, marker = room._nodes[kept["id"]].handles["things"]
    radius = FIELD.extras["ball"]["radius_mm"] / 1000
    assert ball.position == pytest.approx([0.5, -0.25, radius]) and robot.position[
        :2
    ] == pytest.approx([0, 1])
    assert marker.position[2] == pytest.approx(0.15)
    room.set_state({"layers": []})
    assert not ball.visible
    room.show_detections(kept["id"], [])
    assert room._nodes[kept["id"]].handles["things"] == []
    # a camera that was replaced meanwhile
    room.show_detections("nobody", seen.to_json()["detections"])
    assert "nobody" not in room._nodes


def test_a_look_changes_only_what_it_is_told():
    look = ViewState().changed({"sheet": "hat"}).changed({"layers": ["rays"]})
    assert (look.sheet, look.layers, look.view) == ("hat", frozenset({"rays"}), "free")


def test_the_file_needs_nobody(kept, room):
    room.show(shown(kept))
    html = whole_page(room.server.scene.as_html(dark_mode=False), "<North>")
    assert "<title>&lt;North&gt;</title>" in html and "__VISER_EMBED_DATA__" in html
    assert re.search(r"Content-Security-Policy\" content=\"default-src 'none'", html)
    assert not re.search(r"""(?:src|href)=["']https?:""", html)
