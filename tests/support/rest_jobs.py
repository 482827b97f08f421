"""Jobs over REST."""

from tests.support.refusals import API
from tests.support.waiting import LONG_S, until


def finished(client, job: dict, seconds: float = LONG_S) -> dict:
    """A job as REST shows it, once it has ended."""
    return until(
        lambda: client.get(f"{API}/jobs/{job['id']}").json(),
        lambda now: now["state"] in ("done", "failed", "cancelled"),
        seconds,
    )


def accepted(answer) -> dict:
    """The job of a 202."""
    assert answer.status_code == 202, answer.text
    job = answer.json()
    assert answer.headers["location"] == f"{API}/jobs/{job['id']}" and job["state"] == "queued"
    return job
