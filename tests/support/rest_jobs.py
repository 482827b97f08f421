"""Waiting for jobs through the REST door."""

import time

from tests.support.refusals import API


def ended(client, job: dict, seconds: float = 90.0) -> dict:
    """The job when it has ended."""
    until = time.monotonic() + seconds
    while True:
        told = client.get(f"{API}/jobs/{job['id']}").json()
        if told["state"] in ("done", "failed", "cancelled"):
            return told
        assert time.monotonic() < until, told
        time.sleep(0.05)


def accepted(answer) -> dict:
    """The job of a 202."""
    assert answer.status_code == 202, answer.text
    job = answer.json()
    assert answer.headers["location"] == f"{API}/jobs/{job['id']}" and job["state"] == "queued"
    return job
