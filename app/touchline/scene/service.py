"""Open scenes, each a process of its own; what a scene shows; viser's page, and a scene as a file, by that page."""

import asyncio
import contextlib
import secrets
from collections.abc import AsyncIterator, Callable, Sequence
from contextlib import asynccontextmanager
from dataclasses import dataclass
from functools import cache
from html import escape
from importlib.metadata import distribution
from pathlib import Path

from touchline.core.errors import BadInput, Busy, Conflict, NotFound, TouchlineError
from touchline.core.json_values import JsonObject
from touchline.core.opencv import shrink_to_width
from touchline.core.records import Calibration
from touchline.core.sentences import CALIBRATE_AND_ACTIVATE, camera_not_calibrated
from touchline.core.statements import say, stated
from touchline.images import encode
from touchline.processes.async_process import AsyncProcess
from touchline.processes.framing import decode_body
from touchline.processes.start import Program
from touchline.scene import messages
from touchline.services.container import Services
from touchline.store.repository import LruCache

MAX_SCENES = 4  # at once: each is a process with viser in it
MAX_FILES = 4  # of 1 MB each; one takes a process and two seconds, and a version never changes
MEMORY_BYTES = 6 << 30  # of addresses: viser's threads reserve much more than they use
NICE = 10  # behind everything else: whoever looks at a scene can wait
ANSWER_S = 60.0
PICTURE_PX = 960  # width of the picture that was calibrated
# viser's page without its panel and notices, since our own page has the controls: the panel lets a viewer enter another
# server's address, and both cover the scene.
STYLE = (
    "<style>[data-floating-window],[data-dock-edge],.mantine-Notifications-root{display:none!important}"
    "</style>"
)
# It unpacks itself, which takes inline scripts and WebAssembly; its decoders take eval. Our own pages' policy stays as
# tight as it is (api/middleware).
EXPORT_POLICY = (
    "default-src 'none'; script-src 'unsafe-inline' 'unsafe-eval' blob:; style-src 'unsafe-inline'; "
    "img-src blob: data:; font-src data:; worker-src blob: data:; base-uri 'none'; form-action 'none'; "
    "connect-src blob: data:"
)  # a saved file talks to nobody
# behind our own port, to that port alone
PAGE_POLICY = f"{EXPORT_POLICY} 'self'; frame-ancestors 'self'"
OnClick = Callable[[JsonObject], None]


class SceneState:
    """open: the open scenes. files: scenes as HTML files, by all that is in them."""

    def __init__(self, _services: Services) -> None:
        self.open = SceneRegistry()
        self.files: LruCache[tuple[object, ...], bytes] = LruCache(MAX_FILES)

    async def aclose(self) -> None:
        """End all processes."""
        await self.open.aclose()


class SceneProcess(AsyncProcess):
    """A process with viser in it. port and key: where viser listens, and what it must be sent; viewers: how many."""

    PROGRAM = Program("touchline.scene.live:main", MEMORY_BYTES, NICE)
    START_S = 45.0  # importing viser takes 1 s, on a busy small machine many
    CANNOT_START = NOT_READY = (
        "The 3-D scene cannot be started.",
        "Free some memory, then open the scene again.",
        "scene-process",
    )
    SILENT = "The scene is not responding.", "Open it again.", "scene-silent"
    ENDED = "The 3-D scene has ended.", "Open the scene again.", "scene-gone"
    key: str
    port: int
    viewers: int
    _on_click: OnClick
    _listening: asyncio.Task[None]

    @classmethod
    async def open(cls, on_click: OnClick) -> "SceneProcess":
        """Return a living process with an empty scene. on_click: called with what a click on the carpet means."""
        key = secrets.token_hex(16)
        process = await cls.start({"key": key})
        process.key, process.port, process.viewers = key, process.start_head["port"], 0
        process._on_click = on_click
        process._listening = asyncio.create_task(process._listen(), name="scene")
        return process

    @property
    def is_alive(self) -> bool:
        return not self._listening.done()

    async def show(self, given: JsonObject) -> JsonObject:
        """Draw it all anew; return what is said beside the scene. What cannot be shown is refused."""
        return (await self.request(messages.DRAW, given, ANSWER_S))[0]

    async def export(self, title: str, dark: bool) -> bytes:
        """Return the scene as it is, as one HTML file that asks for no server."""
        html = (await self.request(messages.EXPORT, {"dark": dark}, ANSWER_S))[1]
        return whole_page(bytes(html).decode(), title).encode("utf-8", "replace")

    async def close(self) -> None:
        """End the process, and the listening to it."""
        await self.end()
        self._listening.cancel()
        with contextlib.suppress(asyncio.CancelledError):
            await self._listening

    async def _listen(self) -> None:
        with contextlib.suppress(OSError, asyncio.IncompleteReadError):
            while True:
                kind, _, body = await self.receive()
                if kind == messages.CLICKED:
                    self._on_click(decode_body(body)[0])
                elif kind == messages.VIEWERS:
                    self.viewers = decode_body(body)[0]["count"]
        self.fail_requests()


class SceneRegistry:
    """Open scenes by name. Only for the event loop's own thread."""

    def __init__(self) -> None:
        self._open: dict[str, SceneProcess] = {}
        self._count = 0  # also those that are starting or ending

    @asynccontextmanager
    async def scene(
        self, on_click: OnClick = lambda _click: None
    ) -> AsyncIterator[tuple[str, SceneProcess]]:
        """Yield a scene of one's own and its name in an address; Busy, Unavailable."""
        if self._count >= MAX_SCENES:
            raise Busy(
                say(
                    "scene.too-many",
                    "{scenes} scenes are open, which is the maximum.",
                    scenes=MAX_SCENES,
                ),
                say("scene.close-one", "Close one in another tab."),
                reason="too-many-scenes",
            )
        self._count += 1
        try:
            process = await SceneProcess.open(on_click)
            name = secrets.token_urlsafe(12)
            self._open[name] = process
            try:
                yield name, process
            finally:
                self._open.pop(name, None)
                await asyncio.shield(process.close())
        finally:
            self._count -= 1

    def get(self, name: str) -> SceneProcess:
        """Return one that is open; NotFound."""
        try:
            return self._open[name]
        except KeyError:
            raise NotFound(
                say("scene.not-open", "This scene is no longer open."),
                say("scene.open-from-page", "Open it from the page."),
                reason="unknown-scene",
            ) from None

    async def aclose(self) -> None:
        """End all processes."""
        processes, self._open = self._open, {}
        await asyncio.gather(*(process.close() for process in processes.values()))


@dataclass(frozen=True)
class SceneContent:
    """records: as the scene's process takes them. calibrations: by key. missing: what cannot be shown, and why."""

    records: JsonObject
    calibrations: dict[str, Calibration]
    missing: list[JsonObject]


def scene_content(
    services: Services,
    calibrations: Sequence[str] | None = None,
    rig: str | None = None,
    lens: str | None = None,
    before: str | None = None,
) -> SceneContent:
    """Read everything that a scene shows; NotFound for what does not exist."""
    store = services.store
    if lens is not None:
        return SceneContent({"lens": store.lenses.get(lens)}, {}, [])
    missing: list[JsonObject] = []
    if rig is not None:
        shown, missing = _calibrated_cameras(services, rig)
    else:
        shown = [store.calibrations.get(id) for id in dict.fromkeys(calibrations or ())]
    if not shown:
        raise BadInput(
            say("scene.nothing", "There is nothing to show."),
            say("scene.select", "Select calibrations, a rig or a lens."),
            reason="nothing-to-show",
        )
    older = store.calibrations.get(before) if before is not None else None
    if older is not None and (
        len(shown) > 1 or older.camera != shown[0].camera or older.image_size != shown[0].image_size
    ):
        raise Conflict(
            say(
                "scene.versions-differ",
                "The two versions are not for the same camera and image size.",
            ),
            say("scene.older-version", "Choose an older version of the same camera."),
            reason="size-mismatch",
        )
    return SceneContent(
        {
            "cameras": [
                {
                    "key": one.id,
                    "title": title_of(services, one),
                    "calibration": one.to_json(),
                    "before": older.to_json() if older is not None else None,
                }
                for one in shown
            ]
        },
        {one.id: one for one in shown},
        missing,
    )


def _calibrated_cameras(services: Services, rig: str) -> tuple[list[Calibration], list[JsonObject]]:
    """Return the active calibrations of a rig, and its cameras without one; Conflict where none has any."""
    shown, missing = [], []
    for camera in services.store.rigs.get(rig).body["cameras"]:
        active = services.store.calibrations.active(camera["camera"])
        if active is None:
            title = services.cameras.title(camera["camera"])
            missing.append(
                stated(
                    {
                        "camera": camera["camera"],
                        "text": camera_not_calibrated(title),
                        "fix": CALIBRATE_AND_ACTIVATE,
                    }
                )
            )
        else:
            shown.append(active)
    if not shown:
        raise Conflict(
            say("rig.none-calibrated", "No camera of this rig is calibrated."),
            say("rig.calibrate-one", "Calibrate a camera and activate the version."),
            reason="not-calibrated",
        )
    return shown, missing


def title_of(services: Services, calibration: Calibration) -> str:
    """Return the name of the calibration's camera for operators."""
    return "Camera" if calibration.camera is None else services.cameras.title(calibration.camera)


def calibration_jpeg(services: Services, calibration: Calibration) -> bytes | None:
    """Return the picture that was calibrated, small, as a JPEG; None if it is gone."""
    if calibration.snapshot is None:
        return None
    try:
        frame = services.frame(calibration.snapshot)
    except TouchlineError:
        return None
    return (
        encode(shrink_to_width(frame.pixels, PICTURE_PX), "jpg")
        if frame.size == calibration.image_size
        else None
    )


@cache
def client_page() -> bytes:
    """Return the page as UTF-8 HTML. Importing viser would cost the server half a second and 50 MB."""
    html = Path(str(distribution("viser").locate_file("viser/client/build/index.html")))
    return _with_style(html.read_text(encoding="utf-8")).encode()


def whole_page(html: str, title: str) -> str:
    """Add the policy of a saved file, a title and our style to viser's page with a scene in it."""
    return _with_style(
        html,
        f'<meta http-equiv="Content-Security-Policy" content="{EXPORT_POLICY}">'
        f"<title>{escape(title)}</title>",
    )


def _with_style(html: str, more: str = "") -> str:
    """Insert our style and more into the page's head."""
    head = html.index("<head>") + len("<head>")
    return f"{html[:head]}{more}{STYLE}{html[head:]}"
