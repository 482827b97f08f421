"""Who may come in."""

import re

import pytest
from starlette.testclient import TestClient

from touchline.api.middleware.access import COOKIE, MAX_WRONG, OPEN, cookie_of
from touchline.main import create_app
from touchline.settings import Settings

TOKEN = "a-token-that-is-long-enough"
HEALTH = "/api/v1/health"
LAN = "http://10.0.0.5:8000"
BORDER = {"points": [[0, 0], [0, 50], [1, 100], [0, 150]], "axis": "x_of_y", "degree": 1}


@pytest.fixture
def guarded(tmp_path):
    settings = Settings(data=tmp_path, token=TOKEN, server={"host": "0.0.0.0"})
    with TestClient(create_app(settings), base_url=LAN, follow_redirects=False) as client:
        yield client


@pytest.fixture(scope="module")
def shut(tmp_path_factory):
    """The same, for those who bring no token."""
    settings = Settings(
        data=tmp_path_factory.mktemp("data"), token=TOKEN, server={"host": "0.0.0.0"}
    )
    with TestClient(create_app(settings), base_url=LAN, follow_redirects=False) as client:
        yield client


def every_call(app):
    """(method, path) of everything in the documentation, ids filled in."""
    for path, methods in app.openapi()["paths"].items():
        for method in methods:
            yield method.upper(), path.replace("{format}", "json").replace("{", "").replace("}", "")


def test_every_call_but_the_open_ones_wants_the_token(shut):
    calls = list(every_call(shut.app))
    assert len(calls) > 10
    for method, path in calls:
        answer = shut.request(method, path)
        if path in OPEN:
            assert answer.status_code == 200, path
        else:
            assert answer.status_code == 401, path
            assert answer.json()["fix"] and answer.headers["www-authenticate"] == "Bearer"


def test_health_says_only_that_the_server_is_ok_until_the_token_is_there(guarded):
    told = [
        guarded.get(HEALTH),
        guarded.get(HEALTH, headers={"Cookie": f"{COOKIE}=of an older token"}),
        guarded.get(HEALTH, headers={"Authorization": "Bearer wrong"}),
    ]
    assert [(one.status_code, one.json()) for one in told] == [(200, {"status": "ok"})] * 3
    whole = guarded.get(HEALTH, headers={"Authorization": f"Bearer {TOKEN}"}).json()
    assert {"status", "version", "uptime_s", "warnings", "damaged"} <= whole.keys()
    guarded.post("/login", data={"token": TOKEN})
    assert guarded.get(HEALTH).json().keys() == whole.keys()


def test_tokens_are_guessed_as_slowly_by_way_of_health(guarded):
    wrong = [
        guarded.get(HEALTH, headers={"Authorization": f"Bearer {i}"}).status_code
        for i in range(MAX_WRONG + 3)
    ]
    assert wrong == [200] * MAX_WRONG + [429] * 3
    assert guarded.get(HEALTH).status_code == 200  # who sends none guesses none


@pytest.mark.parametrize(
    "path", ["/", "/docs", "/api/v1/openapi.json", "/vendor/preact.js", "/app.js", "/help/api.md"]
)
def test_the_page_and_its_files_want_the_token_too(shut, path):
    assert shut.get(path).status_code == 401


def test_a_bearer_header_lets_scripts_in(guarded):
    assert (
        guarded.get("/api/v1/models", headers={"Authorization": f"Bearer {TOKEN}"}).status_code
        == 200
    )


def test_a_browser_is_led_to_the_login_and_gets_a_cookie_for_the_token(guarded):
    asked = guarded.get("/", headers={"Accept": "text/html"})
    assert (asked.status_code, asked.headers["location"]) == (303, "/login")
    assert "<form" in guarded.get("/login").text
    given = guarded.post("/login", data={"token": TOKEN})
    assert given.status_code == 303
    cookie = given.headers["set-cookie"]
    assert "HttpOnly" in cookie and "SameSite=strict" in cookie and TOKEN not in cookie
    assert guarded.get("/api/v1/models").status_code == 200  # the client kept the cookie


def test_who_signs_out_needs_the_token_again(guarded):
    guarded.post("/login", data={"token": TOKEN})
    elsewhere = guarded.post("/logout", headers={"Origin": "http://evil.example"})
    assert elsewhere.status_code == 403 and guarded.get("/api/v1/models").status_code == 200
    assert (
        guarded.get("/logout").status_code in (404, 405)
        and guarded.get("/api/v1/models").status_code == 200
    )
    left = guarded.post("/logout", headers={"Origin": LAN})
    assert (left.status_code, left.headers["location"]) == (303, "/login")
    assert "Max-Age=0" in left.headers["set-cookie"] and "HttpOnly" in left.headers["set-cookie"]
    assert guarded.get("/api/v1/models").status_code == 401  # the client has dropped the cookie
    assert guarded.post("/logout").status_code == 401
    assert guarded.post("/logout", headers={"Accept": "text/html"}).headers["location"] == "/login"


def test_without_a_token_signing_out_changes_nothing(standing):
    assert standing.post("/logout", follow_redirects=True).status_code == 200


def test_a_wrong_token_at_the_login_is_told(guarded):
    answer = guarded.post("/login", data={"token": "wrong"})
    assert answer.status_code == 401 and "access token is wrong" in answer.text
    assert guarded.get("/api/v1/models").status_code == 401


def test_guessing_is_slowed_down_and_the_right_token_is_still_heard(guarded):
    wrong = [
        guarded.get("/api/v1/models", headers={"Authorization": f"Bearer {i}"}).status_code
        for i in range(MAX_WRONG + 3)
    ]
    assert wrong[:MAX_WRONG] == [401] * MAX_WRONG and wrong[-1] == 429
    assert (
        guarded.get("/api/v1/models", headers={"Authorization": f"Bearer {TOKEN}"}).status_code
        == 200
    )


def test_cookies_are_guessed_as_slowly_and_the_log_tells_of_it(guarded, caplog):
    said = [
        guarded.get("/api/v1/models", headers={"Cookie": f"{COOKIE}={i:064x}"})
        for i in range(3 * MAX_WRONG)
    ]
    assert [one.status_code for one in said] == [401] * MAX_WRONG + [429] * 2 * MAX_WRONG
    assert said[-1].headers["retry-after"] == "60"
    told = [
        record.getMessage() for record in caplog.records if "wrong token" in record.getMessage()
    ]
    assert len(told) == MAX_WRONG + 1 and all("testclient" in one for one in told)
    assert (
        guarded.get(
            "/api/v1/models", headers={"Cookie": f"{COOKIE}={cookie_of(TOKEN)}"}
        ).status_code
        == 200
    )


def test_a_page_with_an_old_cookie_loses_it_and_is_led_to_the_login(guarded):
    guarded.cookies.set(COOKIE, "of an older token")
    for _ in range(MAX_WRONG + 5):
        # the client has dropped it after the first
        assert guarded.get("/api/v1/models").status_code == 401
    assert guarded.get("/", headers={"Accept": "text/html"}).headers["location"] == "/login"


@pytest.mark.parametrize(
    "header", [b"Bearer \xe9\xff", b"Bearer", b"Basic eDp5", b"", b"Bearer " + b"x" * 9000]
)
def test_a_strange_header_is_only_a_wrong_token(guarded, header):
    assert guarded.get("/api/v1/models", headers={b"Authorization": header}).status_code == 401


@pytest.mark.parametrize(
    "cookie", ["touchline=", 'touchline="\\377"', "touchline=\xe9", ";;;=", "touchline=[]{}"]
)
def test_a_strange_cookie_is_no_token(guarded, cookie):
    assert (
        guarded.get("/api/v1/models", headers={b"Cookie": cookie.encode("latin-1")}).status_code
        == 401
    )


@pytest.mark.parametrize(
    "headers",
    [
        {"Origin": "http://evil.example"},
        {"Origin": "null"},
        {"Origin": "http://127.0.0.1:9999"},
        {"Origin": "http://127.0.0.1:8000.evil.example"},
        {"Origin": "http://["},
        {"Sec-Fetch-Site": "cross-site"},
        {"Sec-Fetch-Site": "same-site"},
        {
            "Sec-Fetch-Site": "cross-site",
            "Sec-Fetch-Mode": "navigate",
            "Sec-Fetch-Dest": "document",
        },
    ],
)
def test_another_sites_page_changes_nothing(standing, headers):
    answer = standing.post(
        "/api/v1/fit/border", json=BORDER, headers={k: v.encode() for k, v in headers.items()}
    )
    assert answer.status_code == 403 and answer.json()["fix"]


@pytest.mark.parametrize("site", ["cross-site", "same-site"])
def test_another_sites_page_reads_nothing_but_may_link_here(standing, site):
    for path in ("/api/v1/settings", "/api/v1/archive", "/"):
        for how in (
            {},
            {"Sec-Fetch-Mode": "no-cors", "Sec-Fetch-Dest": "image"},
            {"Sec-Fetch-Mode": "navigate", "Sec-Fetch-Dest": "embed"},
        ):
            answer = standing.get(path, headers={"Sec-Fetch-Site": site, **how})
            assert answer.status_code == 403 and answer.json()["fix"], (path, how)
    link = {"Sec-Fetch-Site": site, "Sec-Fetch-Mode": "navigate", "Sec-Fetch-Dest": "document"}
    assert standing.get("/", headers=link).status_code == 200


def test_our_own_page_may(standing):
    headers = {"Origin": "http://127.0.0.1:8000", "Sec-Fetch-Site": "same-origin"}
    assert standing.post("/api/v1/fit/border", json=BORDER, headers=headers).status_code == 200


@pytest.mark.parametrize(
    "host", ["evil.example", "evil.example:8000", "127.0.0.1.evil.example", ""]
)
def test_a_name_that_only_points_here_is_not_answered(standing, host):
    assert standing.get("/api/v1/health", headers={"Host": host}).status_code == 403


@pytest.mark.parametrize("path", ["/api/v1/health", "/login", "/"])
@pytest.mark.parametrize("host", ["[", "[::1", "a]b"])
def test_what_is_no_host_is_told_so(standing, guarded, host, path):
    for client in (standing, guarded):
        answer = client.get(path, headers={"Host": host.encode()})
        assert answer.status_code == 400 and answer.json()["fix"]


@pytest.mark.parametrize("host", ["127.0.0.1", "localhost:8000", "LOCALHOST", "[::1]:8000"])
def test_this_machines_own_names_are(standing, host):
    assert standing.get("/api/v1/health", headers={"Host": host}).status_code == 200


def test_every_answer_says_what_a_page_may_load(standing):
    for path in ("/api/v1/health", "/nowhere", "/docs", "/login"):
        headers = standing.get(path, follow_redirects=False).headers
        assert "default-src 'self'" in headers["content-security-policy"], path
        assert headers["x-content-type-options"] == "nosniff"
        assert (
            headers["cross-origin-resource-policy"]
            == headers["cross-origin-opener-policy"]
            == "same-origin"
        )
        assert (
            headers["x-frame-options"] == "SAMEORIGIN"
            and "camera=()" in headers["permissions-policy"]
        )


@pytest.mark.parametrize(
    ("path", "to"),
    [
        ("/api/v1/cameras/?a=1", "/api/v1/cameras?a=1"),
        ("/login/", "/login"),
        ("//evil.example/api/v1/cameras/", None),
    ],
)
def test_no_redirect_leads_to_the_host_that_a_caller_names(guarded, path, to):
    answer = guarded.request(
        "GET",
        f"http://evil.example{path}",
        headers={"Authorization": f"Bearer {TOKEN}", "Host": "evil.example"},
    )
    assert answer.headers.get("location") == to


def test_the_documentation_page_loads_nothing_from_elsewhere(standing):
    page = standing.get("/docs").text
    assert "//" not in page.replace("<!doctype", "")
    loaded = re.findall(r'(?:src|href)="([^"]+)"', page)
    assert len(loaded) == 3 and all(standing.get(path).status_code == 200 for path in loaded)
