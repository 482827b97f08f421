"""What capabilities keep while a server runs: made once, closed with the server, and made anew by the next one."""

import asyncio

import pytest

from touchline.main import create_app
from touchline.settings import Settings


class Plain:
    def __init__(self, services):
        self.services = services


class Closing(Plain):
    closed: tuple[type, ...] = ()

    async def aclose(self):
        Closing.closed = (*Closing.closed, type(self))


class Failing(Closing):
    async def aclose(self):
        await super().aclose()
        raise RuntimeError("it cannot be closed")


@pytest.fixture
def services(tmp_path, monkeypatch):
    monkeypatch.setattr(Closing, "closed", ())
    return create_app(Settings(data=tmp_path), serves=False).state.services


def test_a_part_is_made_once_and_closed_with_the_server(services):
    async def story():
        async with services.running():
            first = services.part(Closing), services.part(Plain)
            assert (
                first == (services.part(Closing), services.part(Plain))
                and first[0].services is services
            )
            assert Closing.closed == ()
        assert Closing.closed == (Closing,)
        assert services.part(Closing) is not first[0]

    asyncio.run(story())


def test_one_that_cannot_be_closed_keeps_no_other_open(services):
    async def story():
        with pytest.raises(RuntimeError, match="cannot be closed"):
            async with services.running():
                services.part(Closing), services.part(Failing)

    asyncio.run(story())
    assert Closing.closed == (Failing, Closing)
