"""What goes out now, and what only would."""

from tests.support.exported import example
from touchline.core.errors import Unavailable
from touchline.league.live import PublishStatus
from touchline.league.packet import PublishingConfig, published_cameras


def test_no_camera_is_on_air_while_there_is_no_packet_or_it_cannot_be_sent():
    cameras = published_cameras([example("ssl", 0)], PublishingConfig())
    failed = Unavailable("The geometry cannot be published.", "Try again.", reason="failed")
    assert PublishStatus(1, b"packet", 0.0, cameras=cameras).on_air == cameras
    assert PublishStatus(0, b"", None, cameras=cameras).on_air == ()
    assert PublishStatus(1, b"packet", 0.0, 1, failed, cameras).on_air == ()
