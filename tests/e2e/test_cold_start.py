"""The first load of the page, as over a tournament's network: few requests, few bytes."""

from playwright.sync_api import expect

from tests.e2e.conftest import LONG_MS
from tests.support.page_build import page_build
from tests.support.paths import STATIC

MOST_REQUESTS = (
    31  # of different addresses: what is asked again in the meantime depends on the machine
)
MOST_BYTES = 277_000


def test_the_page_is_there_after_a_few_requests_and_bytes(browser, server, tmp_path):
    # as an installation does; an edited checkout is served module by module
    page_build().build_page(STATIC)
    context = browser.new_context()
    page = context.new_page()
    network = context.new_cdp_session(page)
    network.send("Network.enable")
    address, received = {}, {}

    def asked(event):
        address[event["requestId"]] = event["request"]["url"]

    def loaded(event):
        received.setdefault(address[event["requestId"]], event["encodedDataLength"])

    network.on("Network.requestWillBeSent", asked)
    network.on("Network.loadingFinished", loaded)
    page.goto(server.url)
    expect(page.get_by_test_id("camera-overhead")).to_be_visible(timeout=LONG_MS)
    expect(page.get_by_test_id("live-overhead")).to_have_attribute(
        "data-state", "live", timeout=LONG_MS
    )
    assert any("built/page/main.js" in url for url in received)
    assert len(received) <= MOST_REQUESTS, received
    assert sum(received.values()) <= MOST_BYTES, received
    print(f"{len(received)} requests, {sum(received.values()) / 1000:.0f} kB")
    context.close()
