"""An answer of the server that is overtaken: told to the page only when everything asked after it was answered."""

from playwright.sync_api import APIResponse, Page, Route

from tests.support.waiting import until


class OldAnswer:
    """The answer to the page's next GET of an address; the server has made it, and comes() lets the page have it."""

    def __init__(self, page: Page, address: str) -> None:
        self._page, self._address = page, address
        self._told: list[tuple[Route, APIResponse]] = []
        page.route(address, self._hold)

    def _hold(self, route: Route) -> None:
        if self._told or route.request.method != "GET":
            route.fallback()
        else:
            self._told.append((route, route.fetch()))

    def made(self) -> "OldAnswer":
        """Once the page has asked and the server has answered."""
        until(self._told_soon)
        return self

    def _told_soon(self) -> list[tuple[Route, APIResponse]]:
        self._page.wait_for_timeout(50)  # in which the page goes on
        return self._told

    def comes(self) -> None:
        """What the page makes of it is there when this returns: nothing may be."""
        ((route, answer),) = self._told
        with self._page.expect_response(lambda it: it.request == route.request):
            route.fulfill(response=answer)
        self._page.unroute(self._address)
        self._page.wait_for_timeout(300)
