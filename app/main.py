"""create_app(settings) wires the application; serve(settings) runs it."""

import sys
import time
import webbrowser
from collections.abc import AsyncIterator
from contextlib import aclosing, asynccontextmanager, closing

from fastapi import APIRouter, FastAPI

from app import __version__, shipped
from app.api import server
from app.api.middleware import headers, problems
from app.api.middleware.access import Access, login_router
from app.api.middleware.connections import watched_connections
from app.api.middleware.limits import MB, BodyLimits
from app.api.middleware.page_files import PageFiles
from app.api.routes import (
    archive,
    auto,
    board_capture,
    boards,
    calibrations,
    cameras,
    checks,
    clips,
    colours,
    detections,
    docs,
    drafts,
    fields,
    fit,
    health,
    jobs,
    lenses,
    live_detection,
    models,
    motion,
    pairs,
    pictures,
    points,
    publishing,
    reports,
    reregister,
    rigs,
    rolls,
    scene_proxy,
    scenes,
    settings_view,
    snapping,
    snapshots,
    straightness,
    streams,
    tracks,
    uncertainty,
    versions,
)
from app.api.schemas.requests import PROBLEMS
from app.api.work import open_workplaces
from app.images import ImageDecoder, ImageLimits
from app.jobs import JobEngine
from app.scene.scene_registry import SceneRegistry
from app.services.cameras import CameraShelf, live_cameras
from app.services.detection import SeeingShelf
from app.services.frames import Frames
from app.services.open_store import open_store
from app.services.presence import Presence
from app.services.publishing import PublishingShelf
from app.services.result_savers import result_savers
from app.services.scene_pages import ScenePages
from app.settings import LOOPBACK, Settings
from app.store.field_repository import FieldRepository

RESOURCES = (health, archive, cameras, streams, snapshots, fields, drafts, models, fit, versions, calibrations,
             boards, lenses, uncertainty, reports, pairs, rigs, straightness, points, pictures, jobs, detections,
             live_detection, colours, snapping, publishing, settings_view, board_capture, rolls, motion, auto, scenes,
             checks, reregister, tracks, clips)
API = "/api/v1"
# whose functions jobs may be
MODULES = (
    "app.workflows.calibration_request",
    "app.workflows.board_request",
    "app.workflows.pair",
    "app.workflows.straight_lines_request",
    "app.workflows.rig",
    "app.workflows.automatic_request",
    "app.workflows.rolling_request",
    "app.workflows.check",
    "app.workflows.reregister",
)
ABOUT = """Calibrates the cameras above a robot-soccer field.

Pixels are [x, y] from the centre of the top-left pixel; field positions are [x, y] in mm from the field's centre.
A point out of reach is null. Every refusal says what to do in `fix`."""


def create_app(settings: Settings) -> FastAPI:
    """Return the whole application; it keeps the data folder open until it has been served and stopped."""
    work = jobs_of(settings)  # refused before anything is held
    store = open_store(settings)
    work.result_savers.update(result_savers(store))

    @asynccontextmanager
    async def lifespan(app: FastAPI) -> AsyncIterator[None]:
        with store, ImageDecoder(image_limits(settings)) as decoder, work:
            open_workplaces(app)
            app.state.decoder = decoder
            app.state.jobs = work
            work.open(store.jobs)  # and go on with what a stop has cut short
            app.state.frames = Frames(lambda id: decoder.frame_from_bytes(store.snapshots.picture(id)))
            async with aclosing(live_cameras(app)) as live, aclosing(SceneRegistry()) as scenes:
                app.state.live, app.state.scenes = live, scenes
                with closing(app.state.publishing.publishing) as network:
                    network.start()
                    yield

    app = FastAPI(title="Touchline", version=__version__, description=ABOUT, openapi_url=f"{API}/openapi.json",
                  docs_url=None, redoc_url=None, lifespan=lifespan,
                  telemetry={"tracing": False, "metrics": False, "logs": False})
    app.state.settings = settings
    app.state.started = time.monotonic()
    app.state.store = store
    app.state.presence = Presence()
    app.state.scene_pages = ScenePages()
    app.state.fields = FieldRepository(settings.own_fields)
    app.state.camera_shelf = CameraShelf(settings, store, app.state.fields, image_limits(settings))
    app.state.publishing = PublishingShelf(settings, store, app.state.camera_shelf)
    app.state.seeing = SeeingShelf(store, app.state.camera_shelf, app.state.fields, app.state.publishing)
    problems.install(app)
    api = APIRouter(prefix=API, responses=PROBLEMS)
    for resource in RESOURCES:
        api.include_router(resource.router)
    app.include_router(api)
    _add_page(app, settings)
    return app


def image_limits(settings: Settings) -> ImageLimits:
    images = settings.images
    return ImageLimits(max_bytes=int(images.max_file_mb * MB), max_pixels=int(images.max_megapixels * 1e6),
                  max_side_px=images.max_side_px, wall_s=images.decode_timeout_s)


def jobs_of(settings: Settings) -> JobEngine:
    return JobEngine(settings.jobs.workers, engine=settings.jobs.engine, wall_s=settings.jobs.time_limit_s,
                kept=settings.jobs.kept, modules=MODULES)


def _add_page(app: FastAPI, settings: Settings) -> None:
    """Add the page, the login, the documentation, and the middleware that guards all of them."""
    static = shipped("static")
    token = settings.token.get_secret_value() if settings.token else None
    app.include_router(login_router(token))
    app.include_router(docs.docs_router(static))
    app.include_router(scene_proxy.router)
    pages = [page.read_text(encoding="utf-8") for page in static.glob("*.html")] + [docs.PAGE]
    hosts = () if token else (*LOOPBACK, settings.server.host, *settings.server.allowed_hosts)
    # The last one added is the outermost.
    app.add_middleware(PageFiles, folder=static)
    app.add_middleware(BodyLimits, text_bytes=int(settings.server.max_json_mb * MB),
                       upload_bytes=image_limits(settings).max_bytes, text_s=settings.server.request_timeout_s,
                       upload_s=settings.server.upload_timeout_s)
    app.add_middleware(Access, token=token, hosts=hosts)
    app.add_middleware(headers.SafeHeaders, scripts=[h for page in pages for h in headers.inline_hashes(page)])
    app.add_middleware(problems.Unexpected)


def serve(settings: Settings, *, open_page: bool = False, verbose: bool = False) -> None:
    """Serve until a signal ends it; print the address on stdout once the socket listens."""
    data = server.data_folder(settings.data)
    settings = server.with_token(settings, say=lambda text: print(text, file=sys.stderr, flush=True))
    listener = server.open_socket(settings.server.host, settings.server.port)
    url = server.url_of(listener)
    print(f"Touchline {__version__} is at {url}\nIt keeps everything in {data}. Ctrl-C ends it.", flush=True)
    if open_page:
        webbrowser.open(url)
    connection = watched_connections(head_s=settings.server.request_timeout_s,
                                     per_address=settings.server.max_connections_per_address)
    server.run(create_app(settings), listener, settings, connection, log_level="info" if verbose else "warning")
