"""Fields as both of the league's vision programs publish them, received over the network and shown over REST."""

import socket

import pytest

from tests.api.test_rest_league import client, heard, put, way
from tests.support.group_listener import said
from tests.support.league_geometry import MODELS, PROGRAMS, SIZES, packet_of
from tests.support.refusals import API
from tests.support.waiting import until

__all__ = ["client", "way"]


@pytest.mark.parametrize("program", PROGRAMS)
@pytest.mark.parametrize("division", SIZES)
def test_the_division_is_recognised_by_name_whoever_sends_it(client, way, program, division):
    put(client, absorb=True, **way)
    until(lambda: client.get(f"{API}/publishing/heard").json()["listening"])
    with (
        socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as newer,
        socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as older,
    ):
        ports = [
            said(packet_of(program, division, is_older=old).SerializeToString(), **way, sock=sock)
            for sock, old in ((newer, False), (older, True))
        ]
        found = until(
            lambda: len(all_ := heard(client)) == 2 and {one["port"]: one for one in all_}
        )
    title = next(
        one["title"]
        for one in client.get(f"{API}/fields").json()["items"]
        if one["name"] == division
    )
    for port in ports:
        assert found[port]["source"] == program and found[port]["problem"] is None
        assert found[port]["field"] == {
            "name": division,
            "title": title,
            "length_mm": SIZES[division][0],
            "width_mm": SIZES[division][1],
            "known": True,
        }
    rolls, hops = MODELS[program]
    models = found[ports[0]]["ball_models"]
    assert tuple(models["straight_two_phase"].values()) == pytest.approx(rolls)
    assert tuple(models["chip_fixed_loss"].values()) == pytest.approx(hops)
    assert found[ports[1]]["ball_models"] is None
