"""create_app(settings) puts the application together; serve(settings) serves it."""

import os
import sys
import webbrowser
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from functools import partial
from threading import Thread

from fastapi import APIRouter, FastAPI

from touchline.api import server
from touchline.api.description.document import DescribedApi, operation_id
from touchline.api.middleware import limits, problems
from touchline.api.middleware.access import AccessControl, has_token, login_router
from touchline.api.middleware.connections import limited_connections
from touchline.api.middleware.limits import MB, BodyLimits
from touchline.api.middleware.page_files import PageFiles
from touchline.api.requests import PROBLEMS
from touchline.api.responses import API
from touchline.api.routes.server_state import DOCS_PAGE, docs_router
from touchline.capabilities import CALIBRATION, call, jobs, loaded, savers
from touchline.images import ImageLimits
from touchline.installation import __version__, shipped
from touchline.jobs import JobEngine
from touchline.services.container import Services
from touchline.services.fit_processes import FitProcesses
from touchline.services.open_store import open_store
from touchline.settings import LOOPBACK, Settings, unknown_variables

FITS = (CALIBRATION,)  # what a process imports beforehand that fits while its caller waits
ABOUT = """Calibrates the cameras above a robot-soccer field.

Pixels are [x, y] from the centre of the top-left pixel; field positions are [x, y] in mm from the field's centre.
A point that cannot be converted is null. Every refusal states the remedy in `fix`."""


def create_app(settings: Settings, *, serves: bool = True) -> FastAPI:
    """Make the whole application from settings alone. It holds the data folder until it has been served and stopped.

    serves: False where it answers a script's calls and ends: cameras sleep until they are asked for, nothing is sent to
    the league's network or heard from it, and jobs of the server before wait for the next one.
    """
    engine = JobEngine(
        settings.jobs.workers,
        engine=settings.jobs.engine,
        wall_s=settings.jobs.time_limit_s,
        kept=settings.jobs.kept,
        functions=jobs(),
    )  # refused before anything is held
    fits = FitProcesses(settings.jobs.time_limit_s, FITS)
    # A comparison of all models takes some seconds, for which no preview is to wait.
    comparisons = FitProcesses(settings.jobs.time_limit_s, FITS, processes=1, at_once=False)
    services = Services(
        settings, open_store(settings), engine, fits, comparisons, image_limits(settings), serves
    )
    engine.result_savers.update(
        {name: partial(call, target, services) for name, target in savers().items()}
    )

    @asynccontextmanager
    async def lifespan(_app: FastAPI) -> AsyncIterator[None]:
        async with services.running():
            yield

    app = DescribedApi(
        title="Touchline",
        version=__version__,
        description=ABOUT,
        openapi_url=f"{API}/openapi.json",
        docs_url=None,
        redoc_url=None,
        lifespan=lifespan,
        generate_unique_id_function=operation_id,
        telemetry={"tracing": False, "metrics": False, "logs": False},
    )
    app.state.services = services
    problems.install(app)
    api = APIRouter(prefix=API, responses=PROBLEMS)
    for router in loaded("routes"):
        api.include_router(router)
    app.include_router(api)
    _add_page(app, settings)
    return app


def image_limits(settings: Settings) -> ImageLimits:
    images = settings.images
    return ImageLimits(
        max_bytes=int(images.max_file_mb * MB),
        max_pixels=int(images.max_megapixels * 1e6),
        max_side_px=images.max_side_px,
        wall_s=images.decode_timeout_s,
    )


def _add_page(app: FastAPI, settings: Settings) -> None:
    """Add the page, the login, the documentation, and the middleware around everything."""
    static = shipped("static")
    token = settings.token.get_secret_value() if settings.token else None
    app.include_router(login_router(token))
    app.include_router(docs_router(static))
    for router in loaded("page_routes"):
        app.include_router(router)
    pages = [page.read_text(encoding="utf-8") for page in static.glob("*.html")] + [DOCS_PAGE]
    hosts = () if token else (*LOOPBACK, settings.server.host, *settings.server.allowed_hosts)
    # The last one added is the outermost.
    app.add_middleware(PageFiles, folder=static)
    app.add_middleware(
        BodyLimits,
        text_bytes=int(settings.server.max_json_mb * MB),
        upload_bytes=image_limits(settings).max_bytes,
        text_s=settings.server.request_timeout_s,
        upload_s=settings.server.upload_timeout_s,
    )
    app.add_middleware(AccessControl, token=token, hosts=hosts)
    app.add_middleware(
        limits.SecurityHeaders, scripts=[h for page in pages for h in limits.inline_hashes(page)]
    )
    app.add_middleware(problems.UnexpectedErrors)


def serve(settings: Settings, *, open_page: bool = False, verbose: bool = False) -> None:
    """Serve until SIGTERM or Ctrl-C; print the address on stdout once the server answers."""

    def say(text: str) -> None:
        print(text, file=sys.stderr, flush=True)

    # cameras' passwords are in the database and its backups: they are this user's alone
    os.umask(0o077)
    for warning in unknown_variables(os.environ):
        say(warning)
    data = server.data_folder(settings.data)
    settings = server.with_token(settings, say)
    listener = server.open_socket(settings.server.host, settings.server.port)
    url = server.url_of(listener)

    def announce() -> None:
        print(
            f"Touchline {__version__} is running at {url}\nData folder: {data}. Stop with Ctrl-C.",
            flush=True,
        )
        if open_page:
            Thread(target=webbrowser.open, args=(url,), daemon=True).start()

    token = settings.token.get_secret_value() if settings.token else None
    connection = limited_connections(
        head_s=settings.server.request_timeout_s,
        most=settings.server.max_connections,
        per_address=settings.server.max_connections_per_address,
        is_known=lambda headers: has_token(headers, token),
    )
    server.run(
        create_app(settings),
        listener,
        settings,
        connection,
        announce,
        log_level="info" if verbose else "warning",
    )
