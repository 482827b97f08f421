"""The operator's own fields as files: what is saved is read at the next start, and no file stops that."""

import pytest

from touchline.core.errors import BadInput, Conflict, NotFound
from touchline.store import fields as module
from touchline.store.fields import FieldRepository

SIDES = {"full": {"x": [-1500, 1500], "y": [-1000, 1000]}}


def body(name="mine", count=1, **more):
    return {
        "name": name,
        "length_mm": 3000,
        "width_mm": 2000,
        "regions": SIDES,
        "lines": [
            {"name": f"line-{number}", "from": [number, 0.125], "to": [number, 9]}
            for number in range(count)
        ],
        **more,
    }


def test_what_is_saved_is_read_at_the_next_start(tmp_path):
    for name, more in (
        ("mine", {"title": "1:30 – Ümlaut 競技場 # 'null'"}),
        ("null", {"title": "2001-01-01"}),
        ("1e5", {"hat_height_mm": 1e-4 + 75}),
        ("010", {"landmarks": {"on": [0, 1.5]}}),
    ):
        saved = FieldRepository(tmp_path).put(name, body(name, **more))
        again = FieldRepository(tmp_path)
        assert (
            again[name].to_json() == saved.to_json() and again.is_own(name) and again.warnings == ()
        )


def test_a_field_whose_file_could_not_be_read_again_is_refused_and_the_one_before_stays(tmp_path):
    fields = FieldRepository(tmp_path)
    fields.put("mine", body())
    many = {f"{'m' * 50}-{number}": [number, 0.123] for number in range(500)}
    regions = {**SIDES, **{f"{'r' * 50}-{number}": SIDES["full"] for number in range(499)}}
    with pytest.raises(BadInput, match="the limit is"):
        fields.put("mine", body(count=500, landmarks=many, regions=regions))
    assert FieldRepository(tmp_path)["mine"].to_json() == fields["mine"].to_json()
    assert len(fields["mine"].lines) == 1


def test_a_file_that_would_hold_another_field_is_not_written(tmp_path, monkeypatch):
    fields = FieldRepository(tmp_path)
    monkeypatch.setattr(
        module.yaml,
        "dump",
        lambda *_, **__: (
            b"name: mine\nlength_mm: 1000\nwidth_mm: 900\nregions:\n"
            b"  full: {x: [-500, 500], y: [-450, 450]}\n"
        ),
    )
    with pytest.raises(BadInput, match="would not hold"):
        fields.put("mine", body())
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    "damage",
    [
        b"",
        b"\xff\xfe\x00",
        b"name: [",
        b"name: other\n",
        b"a: &a [1]\nb: *a\n",
        b"x" * 300_000,
        b"[" * 5000,
        None,
    ],
)
def test_a_file_that_cannot_be_read_is_set_aside_and_told_and_stops_no_start(tmp_path, damage):
    FieldRepository(tmp_path).put("sound", body("sound"))
    file = tmp_path / "bad.yaml"
    file.mkdir() if damage is None else file.write_bytes(damage)
    fields = FieldRepository(tmp_path)
    assert "sound" in fields and "bad" not in fields
    with pytest.raises(NotFound):
        _ = fields["bad"]
    (warning,) = fields.warnings
    assert warning.reason == "field-not-read" and f"{tmp_path.name}/bad.yaml" in warning.text
    assert warning.fix.endswith("Then restart Touchline.")
    fields.put("bad", body("bad"))
    assert (
        fields.warnings == ()
        and FieldRepository(tmp_path)["bad"].to_json() == fields["bad"].to_json()
    )
    kept = tmp_path / "bad.unread-1"
    assert kept.is_dir() if damage is None else kept.read_bytes() == damage, (
        "it may be all that is left of a field"
    )


def test_an_own_field_named_like_one_that_comes_with_touchline_goes_before_it(tmp_path):
    """An update may bring a name that is taken."""
    FieldRepository(tmp_path).put("mine", body())
    text = (tmp_path / "mine.yaml").read_text().replace("name: mine", "name: table")
    (tmp_path / "table.yaml").write_text(text)
    fields = FieldRepository(tmp_path)
    assert (
        fields["table"].length_mm == 3000
        and fields.is_own("table")
        and list(fields).count("table") == 1
    )
    assert len(fields) == len(list(fields)) and [one.reason for one in fields.warnings] == [
        "field-replaced"
    ]
    fields.put("table", body("table", title="Changed"))
    assert FieldRepository(tmp_path)["table"].title == "Changed"
    fields.delete("table")
    assert (
        fields["table"].length_mm != 3000 and not fields.is_own("table") and fields.warnings == ()
    )
    with pytest.raises(Conflict):
        fields.put("table", body("table"))
