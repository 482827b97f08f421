"""What the page asks waits on its way, as on a slow line: what happens meanwhile can be tried without haste."""

from collections.abc import Iterator
from contextlib import contextmanager

from playwright.sync_api import Page, Request, Route

from tests.support.waiting import until


@contextmanager
def holding(page: Page, url: str, method: str) -> Iterator[list[Request]]:
    """Requests to the address (as page.route takes it) wait until the block ends; those that wait so far."""
    routes: list[Route] = []
    requests: list[Request] = []
    over = False

    def hold(route: Route) -> None:
        if over or route.request.method != method:
            return route.fallback()
        routes.append(route)
        requests.append(route.request)

    page.route(url, hold)
    try:
        yield requests
    finally:
        over = True
        for route in routes:
            route.fallback()
        page.unroute(url, hold)


def wait_until_held(page: Page, requests: list[Request]) -> None:
    """Until the page has asked: only a call to the browser lets its news in."""
    until(lambda: (page.evaluate("() => 0"), len(requests)), lambda seen: seen[1] > 0)
