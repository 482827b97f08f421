"""Activate a version whatever stands against it: for tests of what comes afterwards."""

from typing import Any

from tests.support.refusals import API


def activate_despite(client: Any, id: str, **sent: Any) -> None:
    """Activate it, in spite of all that the server names.

    client: a TestClient, or a server of the browser tests.
    """
    def ask(json: Any) -> Any:
        if hasattr(client, "api"):
            return client.api("POST", f"/calibrations/{id}/activate", json=json, **sent)
        return client.post(f"{API}/calibrations/{id}/activate", json=json, **sent)

    answer = ask({})
    if answer.status_code == 409:
        answer = ask({"despite": answer.json()["despite"]})
    assert answer.status_code == 200, answer.text
