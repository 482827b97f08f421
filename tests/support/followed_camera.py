"""A camera of a server that is followed: its drift, its pictures, and versions that are made of them."""

from tests.support.activation import activate_despite
from tests.support.live_cameras import calibrated
from tests.support.refusals import API
from tests.support.waiting import until

URL = "sim://table?size=480x384&fps=20&robots=3"


def task(**more):
    """A request for a calibration by clicks on its lines."""
    observations = [dict(o) for o in calibrated(URL, "brown-conrady").observations]
    return {
        "field": "table",
        "region": "full",
        "model": "brown-conrady",
        "observations": observations,
        **more,
    }


class Followed:
    """A camera of a server."""

    def __init__(self, client, id):
        self.client, self.path = client, f"{API}/cameras/{id}"
        self.id = id

    def drift(self):
        return self.client.get(f"{self.path}/status").json()["drift"] or {"state": None}

    def becomes(self, state):
        return until(self.drift, lambda now: now["state"] == state)

    def taken(self):
        return self.client.post(f"{API}/snapshots", json={"camera": self.id}).json()["id"]

    def activated(self, **more):
        return self.activated_of(task(**more))

    def activated_of(self, task):
        id = self.saved(task)
        activate_despite(self.client, id)
        return id

    def saved(self, task):
        answer = self.client.post(f"{API}/calibrations", json={"camera": self.id, **task})
        assert answer.status_code == 201, answer.text
        return answer.json()["id"]

    def set_on(self, **controls):
        assert (
            self.client.patch(f"{self.path}/controls", json={"controls": controls}).status_code
            == 200
        )
