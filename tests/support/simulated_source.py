"""The simulator's cameras by their address, with the truth about what they show."""

from collections.abc import Mapping

from touchline.core.field import Field
from touchline.sources import SourceContext, source_from_url
from touchline.sources.sim.source import SimSource


def simulated_source(url: str, fields: Mapping[str, Field]) -> SimSource:
    """Open a camera over one of the fields."""
    source = source_from_url(url, SourceContext(fields))
    assert isinstance(source, SimSource)
    return source
