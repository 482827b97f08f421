"""/docs: the interactive documentation, from files of our own, so that it works without the internet."""

from pathlib import Path

from fastapi import APIRouter
from starlette.responses import HTMLResponse, Response

from touchline.core.errors import Unavailable

START = "SwaggerUIBundle({url: '/api/v1/openapi.json', dom_id: '#swagger-ui', deepLinking: true});"
PAGE = f"""<!doctype html><html lang="en"><head><meta charset="utf-8"><title>Touchline: REST</title>
<link rel="icon" href="/icon.svg">
<link rel="stylesheet" href="/vendor/swagger-ui/swagger-ui.css"></head><body><div id="swagger-ui"></div>
<script src="/vendor/swagger-ui/swagger-ui-bundle.js"></script><script>{START}</script></body></html>"""


def docs_router(static: Path) -> APIRouter:
    """Return the route of the page; it needs the browser libraries fetched when the package was built."""
    router = APIRouter(include_in_schema=False)

    @router.get("/docs")
    def docs() -> Response:
        if not (static / "vendor" / "swagger-ui" / "swagger-ui-bundle.js").is_file():
            raise Unavailable("The files of the documentation page are missing.",
                              "Install Touchline again with access to the npm registry, or use /api/v1/openapi.json.",
                              reason="docs-not-built")
        return HTMLResponse(PAGE)

    return router
