"""How far cameras had moved in the last hours: what is noted, and what is forgotten."""

from touchline.services.activity import ENTRY_S, MAX_ENTRIES, DriftHistory


def status(mm, monitored=True, calibration="a"):
    drift = None if mm is None else {"mm": mm, "monitored": monitored}
    return {"active_calibration": calibration, "drift": drift}


def noted(*story):
    """The entries of a camera with these statuses at these seconds."""
    seconds = iter([second for second, _ in story])
    history = DriftHistory(lambda: next(seconds))
    for _, now in story:
        history.note({} if now is None else {"east": now})
    return history


def entries(*story):
    return [(entry["at"], entry["mm"]) for entry in noted(*story).of("east")]


def test_an_entry_has_the_largest_displacement_of_its_seconds():
    assert entries((0, status(0.1)), (5, status(9.0)), (19, status(0.2)), (20, status(0.3))) == [
        (0, 9.0),
        (20, 0.3),
    ]


def test_where_nothing_is_measured_an_entry_has_none():
    story = [(0, status(None)), (20, status(7.0, monitored=False)), (40, status(0.1))]
    assert entries(*story) == [(0, None), (20, None), (40, 0.1)]
    assert entries((0, status(None)), (1, status(0.1)), (2, status(None))) == [(0, 0.1)]


def test_a_camera_without_a_calibration_has_no_history_and_one_that_has_ended_none_any_more():
    assert entries((0, status(None, calibration=None))) == []
    assert entries((0, status(0.1)), (20, None)) == []


def test_it_is_bounded_and_follows_a_clock_that_is_set_back():
    story = [(ENTRY_S * i, status(float(i))) for i in range(MAX_ENTRIES + 3)]
    kept = entries(*story)
    assert len(kept) == MAX_ENTRIES and kept[0] == (3 * ENTRY_S, 3.0)
    assert entries((0, status(0.1)), (60, status(0.2)), (20, status(0.3))) == [(0, 0.1), (20, 0.3)]


def test_only_what_is_new_is_given_on_request():
    history = noted((0, status(0.1)), (20, status(0.2)), (40, status(0.3)))
    assert [entry["at"] for entry in history.of("east", 20)] == [20, 40]
    assert history.of("west") == []
