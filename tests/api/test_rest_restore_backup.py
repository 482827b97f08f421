"""REST of going back to the newest good backup: what it would cost, doing it while the server runs, and refusals."""

from concurrent.futures import ThreadPoolExecutor

import pytest

from tests.support.refusals import API, refusal
from tests.support.sample_jobs import sleeps_and_says
from tests.support.store_opener import break_database, damage_row
from tests.support.waiting import until
from touchline.store.tables import CalibrationRow

RESTORE = f"{API}/restore-backup"
EAST = {"id": "east", "name": "East", "source": "sim://table?size=320x256&fps=50", "field": "table"}


@pytest.fixture
def store(client):
    return client.app.state.services.store


def backed_up(store):
    """Until the newest backup has all that was saved."""
    until(
        lambda: store._backups.all()[0].changes, lambda newest: newest == store._database.changes()
    )


@pytest.fixture
def damaged(client, store, calibration):
    """The calibration, whole in a backup and damaged since; the camera east has been added since as well."""
    backed_up(store)
    damage_row(store, CalibrationRow, lambda text: text.replace("ssl", "lss"), id=calibration["id"])
    refused = client.get(f"{API}/calibrations/{calibration['id']}")
    assert refused.status_code == 503 and "newest good backup" in refused.json()["fix"]
    assert client.post(f"{API}/cameras", json=EAST).status_code == 201
    assert client.get(f"{API}/cameras/east/status").status_code == 200
    return calibration


def test_the_backup_is_named_then_restored_and_the_server_goes_on_with_it(client, store, damaged):
    (damage,) = client.get(f"{API}/health").json()["damaged"]
    assert (
        damage["restorable"]
        and damage["note"] is None
        and damage["fix"].startswith("Restore the newest")
    )
    assert damage["statements"]["fix"][0]["code"] == "quarantine.restore-backup"
    offer = client.post(RESTORE, json={}).json()
    assert (
        offer["file"] is None
        and offer["lost"] == offer["database"] - offer["backup"] > 0
        and offer["made_at"]
    )
    assert client.post(RESTORE, json={"backup": offer["backup"]}).json() == offer, (
        "only half agreed to"
    )
    assert client.get(f"{API}/calibrations/{damaged['id']}").status_code == 503, "nothing was done"
    agreed = {name: offer[name] for name in ("backup", "database")}
    before = client.get(f"{API}/cameras/status").json()["restored"]
    done = client.post(RESTORE, json=agreed).json()
    assert done == {**offer, "file": f"replaced/{offer['database']:012d}/touchline.db"}
    assert client.get(f"{API}/settings").json()["storage"]["replaced"] == [done["file"]]
    assert client.get(f"{API}/calibrations/{damaged['id']}").json() == damaged
    status = client.get(f"{API}/cameras/status").json()
    assert status["restored"] == before + 1 and [one["id"] for one in status["items"]] == ["north"]
    assert "east" not in client.app.state.services.live.running
    assert client.get(f"{API}/health").json()["damaged"] == []
    refusal(client.post(RESTORE, json=agreed), 409, "changed-meanwhile")
    assert client.post(f"{API}/cameras", json=EAST).status_code == 201, "and it saves again"


def test_of_two_operators_at_once_one_restores_and_the_other_is_told(client, store, damaged):
    offer = client.post(RESTORE, json={}).json()
    agreed = {name: offer[name] for name in ("backup", "database")}
    with ThreadPoolExecutor(2) as both:
        answers = sorted(
            both.map(lambda _: client.post(RESTORE, json=agreed), range(2)),
            key=lambda answer: answer.status_code,
        )
    assert answers[0].status_code == 200 and store.restored == 1
    refusal(answers[1], 409, "changed-meanwhile")


def test_a_database_that_breaks_while_the_server_runs_is_told_by_every_call_and_replaced(
    client, store, calibration
):
    backed_up(store)
    break_database(store)
    for answer in (
        client.get(f"{API}/archive"),
        client.get(f"{API}/calibrations"),
        client.post(f"{API}/cameras", json=EAST),
    ):
        assert (answer.status_code, answer.json()["type"]) == (503, "/problems/database-damaged")
    told = [
        one
        for one in client.get(f"{API}/health").json()["warnings"]
        if one["reason"] == "database-damaged"
    ]
    assert len(told) == 1 and "newest good backup" in told[0]["fix"]
    offer = client.post(RESTORE, json={}).json()
    done = client.post(RESTORE, json={name: offer[name] for name in ("backup", "database")}).json()
    assert (
        done["lost"] == 0
        and client.get(f"{API}/calibrations/{calibration['id']}").json() == calibration
    )
    health = client.get(f"{API}/health").json()
    assert health["damaged"] == [] and "database-damaged" not in [
        one["reason"] for one in health["warnings"]
    ]
    assert client.post(f"{API}/cameras", json=EAST).status_code == 201, "and it saves again"


def test_without_a_good_backup_it_is_refused(client, store, damaged):
    with store._backups.held:
        for backup in store._backups.all():
            backup.path.unlink()
    for body in ({}, {"backup": 1, "database": 2}):
        problem = refusal(client.post(RESTORE, json=body), 409, "no-good-backup")
        assert "archive" in problem["fix"]
    assert client.get(f"{API}/cameras/east").status_code == 200


def test_while_a_job_runs_it_is_refused_and_afterwards_jobs_are_those_of_the_backup(
    client, store, damaged
):
    offer = client.post(RESTORE, json={}).json()
    jobs = client.app.state.services.jobs
    job = jobs.start("preview", sleeps_and_says, {"seconds": 60, "steps": 60}, durable=False)
    agreed = {name: offer[name] for name in ("backup", "database")}
    assert "cancel" in refusal(client.post(RESTORE, json=agreed), 409, "jobs-under-way")["fix"]
    jobs.cancel(job.id)
    assert client.post(RESTORE, json=agreed).status_code == 200
    assert client.get(f"{API}/jobs/{job.id}").json()["state"] == "cancelled", (
        "its caller still reads how it ended"
    )
    assert jobs.start("preview", sleeps_and_says, {"seconds": 0, "steps": 1}).state == "queued"
    until(lambda: jobs.all()[0].state, lambda state: state == "done")


@pytest.mark.parametrize(
    "body", [{"backup": "1", "database": 2}, {"backup": 1.5}, {"change": 1}, [], None]
)
def test_a_request_that_is_not_understood_restores_nothing(client, body):
    refusal(client.post(RESTORE, json=body), 422)
