"""Other browsers than Chromium, with the standard library alone: Firefox by Marionette, WebKit by WebDriver's HTTP.

Each is a real program in a window on a virtual screen, where both have WebGL drawn in software. What is found on the
page is named by its data-testid.
"""

import base64
import json
import os
import shutil
import socket
import subprocess
import urllib.error
import urllib.request
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

from tests.support.waiting import LONG_S, until

ELEMENT = "element-6066-11e4-a52e-4f735466cecf"  # the key under which WebDriver names an element
SCRIPT_MS = 60_000
STEP_MS, STEPS = 30, 8  # of a drag
# whether it is installed or not: WebKit would call the plain one the language "C"
LOCALE = "en_GB.UTF-8"
END_S = 30
MINI_BROWSERS = "lib/*/webkit2gtk-4.*/MiniBrowser"
CONTROL, ESCAPE, ENTER = "\ue009", "\ue00c", "\ue007"
# What Firefox would fetch, ask or show by itself; a port of 0 is a free one, which it writes into its profile.
PREFERENCES = {
    "marionette.port": 0,
    "remote.prefs.recommended": True,
    "webgl.force-enabled": True,
    "network.proxy.type": 0,
    # in software it is none, and reading such a canvas back yields black
    "gfx.canvas.accelerated": False,
    "intl.accept_languages": "en-GB, en",
    "browser.shell.checkDefaultBrowser": False,
    "browser.aboutwelcome.enabled": False,
    "app.update.enabled": False,
    "datareporting.policy.dataSubmissionEnabled": False,
    "toolkit.telemetry.enabled": False,
    "network.captive-portal-service.enabled": False,
    "network.connectivity-service.enabled": False,
    "app.normandy.enabled": False,
    "services.settings.server": "data:,",
    "extensions.update.enabled": False,
    "extensions.getAddons.cache.enabled": False,
    "media.gmp-manager.updateEnabled": False,
    "browser.safebrowsing.downloads.remote.enabled": False,
    "browser.safebrowsing.malware.enabled": False,
    "browser.safebrowsing.phishing.enabled": False,
    "browser.region.network.url": "",
    "browser.search.update": False,
    "browser.topsites.contile.enabled": False,
    "browser.newtabpage.activity-stream.feeds.topsites": False,
}
# All that Firefox's console has: errors and warnings of pages, then what pages wrote.
CONSOLE = """const said = (m) => {
  try { m.QueryInterface(Ci.nsIScriptError); } catch { return ""; }
  return m.flags & 1 ? "" : `${m.category} ${m.sourceName}:${m.lineNumber} ${m.errorMessage}`; };
return [...Services.console.getMessageArray().map(said),
  ...Cc["@mozilla.org/consoleAPI-storage;1"].getService(Ci.nsIConsoleAPIStorage).getEvents()
    .filter((e) => e.level === "error").map((e) => `${e.filename}:${e.lineNumber} ${e.arguments.map(String).join(" ")}`)
].filter((line) => line.includes("127.0.0.1"));"""


class WebDriverError(Exception):
    """What a browser answered instead of doing what it was told."""


class Browser:
    """What a person does with a browser; how commands reach it is up to each."""

    process: subprocess.Popen[bytes]

    def command(self, name: str, **values: Any) -> Any:
        """Carry out one command of WebDriver, and return its value."""
        raise NotImplementedError

    def console(self) -> list[str]:
        """Return the errors in the browser's console."""
        raise NotImplementedError

    def end(self) -> None:
        """End the browser and what it has started."""
        raise NotImplementedError

    def visit(self, url: str) -> None:
        self.command("Navigate", url=url)

    def back(self) -> None:
        self.command("Back")

    def forward(self) -> None:
        self.command("Forward")

    def reload(self) -> None:
        self.command("Refresh")

    def script(self, code: str, *values: Any) -> Any:
        """Run a function's body in the page, and return what it returns."""
        return self.command("ExecuteScript", script=code, args=list(values))

    def until(self, code: str, *values: Any, holds: Callable[[Any], object] = bool) -> Any:
        """Run it again and again, also over the loading of pages, until its answer holds."""

        def look() -> Any:
            try:
                return self.script(code, *values)
            except WebDriverError as error:  # the page is just being changed, or not there yet
                return error

        return until(look, lambda found: not isinstance(found, WebDriverError) and holds(found))

    def sees(self, test_id: str, more: str = "") -> Any:
        """Wait until an element with this name is there and has a size. more: what else must be true of it."""
        return self.until(f"""const it = document.querySelector("[data-testid='{test_id}']");
            return it !== null && it.getClientRects().length > 0 && ({more or "true"});""")

    def click(self, test_id: str) -> None:
        """Press it, once it can be pressed and nothing lies over it."""
        self.sees(test_id, "!it.disabled && it.getAttribute('aria-disabled') !== 'true'")

        def press() -> str:
            try:
                self.command("ElementClick", id=self._find(test_id))
            except WebDriverError as error:
                return str(error)
            return ""

        until(press, lambda refused: not refused)

    def type(self, test_id: str, text: str) -> None:
        self.command("ElementSendKeys", id=self._find(test_id), text=text)

    def choose(self, test_id: str, value: str) -> None:
        """Choose one of a list's options by its value."""
        self.sees(test_id)
        self.command("ElementClick", id=self._find(test_id, f" option[value='{value}']"))

    def press(self, *keys: str) -> None:
        """Press keys together, as a person does a shortcut."""
        down = [{"type": "keyDown", "value": key} for key in keys]
        up = [{"type": "keyUp", "value": key} for key in reversed(keys)]
        self._act({"type": "key", "id": "keyboard", "actions": down + up})

    def click_at(self, x: float, y: float) -> None:
        self._mouse(_move(x, y), _button("Down"), _button("Up"))

    def drag(self, start: tuple[float, float], end: tuple[float, float]) -> None:
        across, down = (end[0] - start[0]) / STEPS, (end[1] - start[1]) / STEPS
        between = (
            _move(start[0] + across * i, start[1] + down * i, STEP_MS) for i in range(1, STEPS + 1)
        )
        self._mouse(_move(*start), _button("Down"), *between, _button("Up"))

    def resize(self, width: int, height: int) -> None:
        """Give the page, not the window, this size."""

        def inner() -> list[int]:
            across, down = self.script("return [innerWidth, innerHeight]")
            if [across, down] != [width, height]:
                now = self.command("GetWindowRect")
                self.command(
                    "SetWindowRect",
                    x=0,
                    y=0,
                    width=now["width"] + width - across,
                    height=now["height"] + height - down,
                )
            return [across, down]

        until(inner, lambda size: size == [width, height])

    def screenshot(self, path: Path) -> None:
        path.write_bytes(base64.b64decode(self.command("TakeScreenshot")))

    def _find(self, test_id: str, within: str = "") -> str:
        found = self.command(
            "FindElement", using="css selector", value=f"[data-testid='{test_id}']{within}"
        )
        return found[ELEMENT]

    def _mouse(self, *actions: dict[str, Any]) -> None:
        self._act(
            {
                "type": "pointer",
                "id": "mouse",
                "parameters": {"pointerType": "mouse"},
                "actions": list(actions),
            }
        )

    def _act(self, source: dict[str, Any]) -> None:
        self.command("PerformActions", actions=[source])
        self.command("ReleaseActions")


def _move(x: float, y: float, duration: int = 0) -> dict[str, Any]:
    return {
        "type": "pointerMove",
        "x": round(x),
        "y": round(y),
        "duration": duration,
        "origin": "viewport",
    }


def _button(way: str) -> dict[str, Any]:
    return {"type": f"pointer{way}", "button": 0}


class Firefox(Browser):
    """Firefox, told what to do by its own protocol: over TCP, each message after its length."""

    packages = ("firefox-esr", "xvfb", "xauth", "libgl1-mesa-dri", "libegl1", "libgl1")

    @staticmethod
    def program() -> str | None:
        return shutil.which("firefox-esr") or shutil.which("firefox")

    def __init__(self, folder: Path, display: str) -> None:
        profile = folder / "profile"
        profile.mkdir()
        lines = (
            f"user_pref({json.dumps(name)}, {json.dumps(value)});\n"
            for name, value in PREFERENCES.items()
        )
        (profile / "user.js").write_text("".join(lines))
        with (folder / "firefox.log").open("wb") as log:
            self.process = subprocess.Popen(
                [
                    str(self.program()),
                    "--marionette",
                    "-remote-allow-system-access",
                    "--no-remote",
                    "--profile",
                    str(profile),
                ],
                stdout=log,
                stderr=subprocess.STDOUT,
                env={
                    **os.environ,
                    "DISPLAY": display,
                    "HOME": str(folder),
                    "LIBGL_ALWAYS_SOFTWARE": "1",
                },
            )
        try:
            port = int(until(lambda: _read(profile / "MarionetteActivePort")))
            self._socket = socket.create_connection(("127.0.0.1", port), timeout=LONG_S)
            self._stream = self._socket.makefile("rb")
            self._receive()  # how it introduces itself
            self._sent = 0
            self.version = self.command("NewSession")["capabilities"]["browserVersion"]
            self.command("SetTimeouts", script=SCRIPT_MS, pageLoad=SCRIPT_MS, implicit=0)
        except BaseException:
            self._kill()
            raise

    def command(self, name: str, **values: Any) -> Any:
        more = (
            {"full": False}
            if name == "TakeScreenshot"
            else {"sandbox": None}
            if name == "ExecuteScript"
            else {}
        )
        return self._ask(f"WebDriver:{name}", {**more, **values})

    def console(self) -> list[str]:
        self._ask("Marionette:SetContext", {"value": "chrome"})
        try:
            return self._ask("WebDriver:ExecuteScript", {"script": CONSOLE, "args": []})
        finally:
            self._ask("Marionette:SetContext", {"value": "content"})

    def end(self) -> None:
        with suppress(OSError, WebDriverError):
            self._ask("Marionette:Quit", {"flags": ["eForceQuit"]})
        self._kill()

    def _kill(self) -> None:
        for one in (getattr(self, "_stream", None), getattr(self, "_socket", None)):
            if one is not None:
                one.close()
        _end(self.process)

    def _receive(self) -> Any:
        digits = b""
        while not digits.endswith(b":"):
            digit = self._stream.read(1)
            if not digit:
                raise WebDriverError("Firefox has ended")
            digits += digit
        return json.loads(self._stream.read(int(digits[:-1])))

    def _ask(self, name: str, values: dict[str, Any]) -> Any:
        self._sent += 1
        message = json.dumps([0, self._sent, name, values]).encode()
        self._socket.sendall(f"{len(message)}:".encode() + message)
        _, _, error, answer = self._receive()
        if error:
            raise WebDriverError(f"{error['error']}: {error['message']}")
        return answer["value"] if isinstance(answer, dict) and {*answer} == {"value"} else answer


WAYS = {
    "Navigate": ("POST", "/url"),
    "Back": ("POST", "/back"),
    "Forward": ("POST", "/forward"),
    "Refresh": ("POST", "/refresh"),
    "ExecuteScript": ("POST", "/execute/sync"),
    "FindElement": ("POST", "/element"),
    "ElementClick": ("POST", "/element/{id}/click"),
    "ElementSendKeys": ("POST", "/element/{id}/value"),
    "PerformActions": ("POST", "/actions"),
    "ReleaseActions": ("DELETE", "/actions"),
    "GetWindowRect": ("GET", "/window/rect"),
    "SetWindowRect": ("POST", "/window/rect"),
    "TakeScreenshot": ("GET", "/screenshot"),
    "SetTimeouts": ("POST", "/timeouts"),
    "End": ("DELETE", ""),
}  # how each command is asked for over HTTP


class WebKit(Browser):
    """WebKitGTK's small browser, told what to do over HTTP: the engine of Safari."""

    packages = (
        "webkit2gtk-driver",
        "xvfb",
        "xauth",
        "libgl1-mesa-dri",
        "libegl1",
        "libgles2",
        "libgbm1",
        "fonts-dejavu-core",
    )

    @staticmethod
    def program() -> str | None:
        return shutil.which("WebKitWebDriver") if any(Path("/usr").glob(MINI_BROWSERS)) else None

    def __init__(self, folder: Path, display: str) -> None:
        self._log = folder / "webkit.log"
        with socket.create_server(("127.0.0.1", 0)) as free:
            self._port = free.getsockname()[1]
        with self._log.open("wb") as log:
            self.process = subprocess.Popen(
                [str(self.program()), f"--port={self._port}"],
                stdout=log,
                stderr=subprocess.STDOUT,
                env={
                    **os.environ,
                    "DISPLAY": display,
                    "HOME": str(folder),
                    "LC_ALL": LOCALE,
                    "LIBGL_ALWAYS_SOFTWARE": "1",
                    "WEBKIT_DISABLE_SANDBOX_THIS_IS_DANGEROUS": "1",
                },
            )
        try:
            until(self._answers)
            browser = {
                "binary": str(next(Path("/usr").glob(MINI_BROWSERS))),
                "args": ["--automation", "--enable-write-console-messages-to-stdout=true"],
            }
            asked = {"capabilities": {"alwaysMatch": {"webkitgtk:browserOptions": browser}}}
            session = self._request("POST", "/session", asked)
            self._session = f"/session/{session['sessionId']}"
            self.version = session["capabilities"]["browserVersion"]
            self.command("SetTimeouts", script=SCRIPT_MS, pageLoad=SCRIPT_MS, implicit=0)
        except BaseException:
            _end(self.process)
            raise

    def command(self, name: str, **values: Any) -> Any:
        method, path = WAYS[name]
        return self._request(method, self._session + path.format(**values), values)

    def console(self) -> list[str]:
        lines = self._log.read_text(errors="replace").splitlines()
        return [line for line in lines if line.startswith("CONSOLE") and " ERROR " in line]

    def end(self) -> None:
        with suppress(OSError, WebDriverError):
            self.command("End")
        _end(self.process)

    def _answers(self) -> bool:
        try:
            return self._request("GET", "/status") is not None
        except OSError:
            return False

    def _request(self, method: str, path: str, body: Any = None) -> Any:
        request = urllib.request.Request(
            f"http://127.0.0.1:{self._port}{path}",
            json.dumps(body).encode() if method == "POST" else None,
            {"Content-Type": "application/json"},
            method=method,
        )
        direct = urllib.request.build_opener(urllib.request.ProxyHandler({}))
        try:
            with direct.open(request, timeout=2 * LONG_S) as answer:
                return json.load(answer)["value"]
        except urllib.error.HTTPError as error:
            with error:
                raise WebDriverError(error.read().decode()) from None


BROWSERS: dict[str, type[Firefox] | type[WebKit]] = {"firefox": Firefox, "webkit": WebKit}


@contextmanager
def virtual_screen() -> Iterator[str]:
    """Start a screen that nobody sees, on the first free number, and yield its name."""
    read, write = os.pipe()
    process = subprocess.Popen(
        ["Xvfb", "-displayfd", str(write), "-screen", "0", "1920x1400x24", "-nolisten", "tcp"],
        pass_fds=[write],
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
    )
    os.close(write)
    try:
        with os.fdopen(read) as told:
            yield f":{int(told.readline())}"
    finally:
        _end(process)


def _end(process: subprocess.Popen[bytes]) -> None:
    """End what we started; what does not hear is killed."""
    if process.poll() is None:
        process.terminate()
    try:
        process.wait(END_S)
    except subprocess.TimeoutExpired:
        process.kill()
        process.wait()


def _read(path: Path) -> str:
    with suppress(FileNotFoundError):
        return path.read_text()
    return ""
