"""Who else has a picture open, and that its draft was saved: told at once, to everybody but who did it."""

from tests.support.refusals import API


def listening(client, path):
    return client.websocket_connect(path, headers={"host": "127.0.0.1:8000"})


def test_two_operators_at_one_picture_see_each_other_and_each_others_saves(client, snapshot):
    path = f"{API}/drafts/{snapshot['id']}"
    with listening(client, f"{path}/stream?name=Ada") as ada:
        assert ada.receive_json() == {"others": [], "etag": None, "by": None}
        with listening(client, f"{path}/stream") as other:
            assert other.receive_json()["others"] == ["Ada"]
            assert ada.receive_json()["others"] == [""]
            etag = client.get(path).headers["etag"]
            saved = client.put(
                path, json={"field": "table"}, headers={"If-Match": etag, "X-Operator": "Grace"}
            )
            for line in (ada, other):
                told = line.receive_json()
                assert f'"{told["etag"]}"' == saved.headers["etag"] and told["by"] == "Grace"
        assert ada.receive_json()["others"] == []


def test_a_name_cannot_move_or_hide_the_words_around_it(client, snapshot):
    path = f"{API}/drafts/{snapshot['id']}"
    with (
        listening(client, f"{path}/stream") as here,
        listening(client, f"{path}/stream?name=%E2%80%AEAda%00%0A%1B[31m%E2%81%A9{'x' * 100}"),
    ):
        here.receive_json()
        (name,) = here.receive_json()["others"]
        assert name == f"Ada[31m{'x' * 57}"
    etag = client.get(path).headers["etag"]
    saved = client.put(path, json={}, headers={"If-Match": etag, "X-Operator": "Gr\tace"})
    assert saved.json()["updated_by"] == "Grace"


def test_who_is_at_another_picture_is_not_told(client, snapshot):
    with (
        listening(client, f"{API}/drafts/{'0' * 16}/stream?name=Ada") as elsewhere,
        listening(client, f"{API}/drafts/{snapshot['id']}/stream") as here,
    ):
        assert elsewhere.receive_json()["others"] == [] and here.receive_json()["others"] == []


def test_nothing_is_remembered_of_a_picture_that_nobody_has_open(client, snapshot):
    path = f"{API}/drafts/{snapshot['id']}"
    with listening(client, f"{path}/stream") as line:
        line.receive_json()
        client.put(path, json={}, headers={"If-Match": client.get(path).headers["etag"]})
        assert line.receive_json()["etag"]
    with listening(client, f"{path}/stream") as line:
        assert line.receive_json() == {"others": [], "etag": None, "by": None}
