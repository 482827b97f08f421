"""Where the browser is: TOUCHLINE_CHROMIUM, else a Chromium or Chrome on the PATH."""

import os
import shutil

NAMES = ("chromium", "chromium-browser", "google-chrome", "google-chrome-stable")
ARGUMENTS = [
    "--no-sandbox",
    "--enable-unsafe-swiftshader",
    "--disable-quic",
    "--no-first-run",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
]
FIX = (
    "No Chromium was found. Install one (apt-get install chromium), or run "
    "`playwright install --with-deps chromium`, or set TOUCHLINE_CHROMIUM to the path of a Chromium or Chrome."
)


def chromium_path() -> str | None:
    """The path of a browser, or None, in which case Playwright's own is the last hope."""
    names = [os.environ.get("TOUCHLINE_CHROMIUM"), *NAMES]
    return next((path for name in names if name and (path := shutil.which(name))), None)
