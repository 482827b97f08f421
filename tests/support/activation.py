"""Activate a version whatever stands against it: for tests and benchmarks of what comes afterwards."""

from typing import Any

import requests

from tests.support.refusals import API


def activate_despite(client: Any, id: str, **sent: Any) -> list[str]:
    """Activate it, in spite of all that the server names; return the codes of that.

    client: a TestClient, a server of the browser tests, or the address of a server.
    """

    def ask(json: Any) -> Any:
        if isinstance(client, str):
            return requests.post(
                f"{client.rstrip('/')}{API}/calibrations/{id}/activate",
                json=json,
                timeout=60,
                **sent,
            )
        if hasattr(client, "api"):
            return client.api("POST", f"/calibrations/{id}/activate", json=json, **sent)
        return client.post(f"{API}/calibrations/{id}/activate", json=json, **sent)

    despite: set[str] = set()
    answer = ask({})
    # A further problem may appear between two requests: the first live image comes meanwhile.
    while answer.status_code == 409 and not despite.issuperset(answer.json()["despite"]):
        despite.update(answer.json()["despite"])
        answer = ask({"despite": sorted(despite)})
    assert answer.status_code == 200, answer.text
    return sorted(despite)
