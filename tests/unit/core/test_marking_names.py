"""Names of borders, markings and areas: one for every id of the shipped fields, the same on the server and the page."""

from tests.support.words import messages
from touchline.core.field import BORDERS
from touchline.core.sentences import AREAS, MARKINGS, area_name, marking_name
from touchline.store.fields import load_fields

FIELDS = load_fields().values()


def of_page(prefix):
    return {
        key.removeprefix(prefix): forms["other"]
        for key, forms in messages().items()
        if key.startswith(prefix)
    }


def test_every_border_marking_and_area_of_the_shipped_fields_has_a_name():
    ids = {*BORDERS}.union(*({*field.lines, *field.arcs, *field.landmarks} for field in FIELDS))
    assert len(ids) > 80
    assert ids <= MARKINGS.keys()
    assert {id for field in FIELDS for id in field.regions} == AREAS.keys()


def test_no_two_have_the_same_name():
    assert len({*MARKINGS.values()}) == len(MARKINGS)
    assert len({*AREAS.values()}) == len(AREAS)


def test_the_server_and_the_page_say_the_same_names():
    assert of_page("markings.") == MARKINGS
    assert of_page("areas.") == AREAS


def test_a_name_states_its_id_and_one_that_an_operator_gave_is_read_as_it_is_written():
    assert marking_name("touch-line-top") == "top touch line"
    assert marking_name("left").statements == ({"code": "line.left", "values": {}},)
    assert area_name("half-left").statements == ({"code": "area.half-left", "values": {}},)
    assert marking_name("my-line") == "my line"
    assert area_name("my-half").statements == ()
