"""The first load of the page, as over a tournament's network: few requests, few bytes."""

from playwright.sync_api import expect

from tests.e2e.conftest import LONG_MS
from tests.support.page_build import page_build
from tests.support.paths import STATIC

MOST_REQUESTS = 60
MOST_BYTES = 600_000


def test_the_page_is_there_after_a_few_requests_and_bytes(browser, server, tmp_path):
    # as an installation does; an edited checkout is served module by module
    page_build().build_page(STATIC)
    context = browser.new_context()
    page = context.new_page()
    network = context.new_cdp_session(page)
    network.send("Network.enable")
    asked, received = [], []
    network.on("Network.requestWillBeSent", lambda event: asked.append(event["request"]["url"]))
    network.on("Network.loadingFinished", lambda event: received.append(event["encodedDataLength"]))
    page.goto(server.url)
    expect(page.get_by_test_id("camera-overhead")).to_be_visible(timeout=LONG_MS)
    expect(page.get_by_test_id("live-overhead")).to_have_attribute(
        "data-state", "live", timeout=LONG_MS
    )
    assert any("built/page/main.js" in url for url in asked)
    assert len(asked) <= MOST_REQUESTS, asked
    assert sum(received) <= MOST_BYTES
    print(f"{len(asked)} requests, {sum(received) / 1000:.0f} kB")
    context.close()
