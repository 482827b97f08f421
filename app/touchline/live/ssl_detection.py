"""The detections of a frame as the Small Size League's SSL_DetectionFrame: one packet a frame and camera.

Lengths in mm, angles in radians, counter-clockwise from field x, pixels raw. What has no place, or a team that the
league has not, is left out; a robot whose pattern cannot be told goes without a number.
"""

from touchline.core.detections import Detection, Detections
from touchline.ssl_protocol.protobuf import build, encode
from touchline.ssl_protocol.ssl_vision_pb2 import (
    SSL_DetectionBall,
    SSL_DetectionFrame,
    SSL_DetectionRobot,
    SSL_Source,
    SSL_WrapperPacket,
)

MAX_PER_KIND = 100  # of a kind: a datagram must hold them


def detection_packet(detections: Detections, camera_number: int, sent_s: float) -> bytes:
    """Return the datagram. sent_s: now, unix; frame and time_s of the detections must be known."""
    placed = [(item, item.x_mm, item.y_mm) for item in detections.items
              if item.x_mm is not None and item.y_mm is not None]
    robots = {team: [_robot(*at) for at in placed if at[0].kind == "robot" and at[0].team == team][:MAX_PER_KIND]
              for team in ("yellow", "blue")}
    balls = [_ball(*at) for at in placed if at[0].kind == "ball"][:MAX_PER_KIND]
    frame = build(SSL_DetectionFrame, frame_number=(detections.frame or 0) % 2**32,
                  t_capture=detections.time_s or sent_s, t_sent=sent_s, camera_id=camera_number, balls=balls,
                  robots_yellow=robots["yellow"], robots_blue=robots["blue"])
    return encode(SSL_WrapperPacket(detection=frame, source=SSL_Source.OTHER))


def _ball(item: Detection, x_mm: float, y_mm: float) -> SSL_DetectionBall:
    return build(SSL_DetectionBall, confidence=item.confidence, area=max(0, round(item.area_px)), x=x_mm, y=y_mm,
                 z=item.z_mm, pixel_x=item.pixel[0], pixel_y=item.pixel[1])


def _robot(item: Detection, x_mm: float, y_mm: float) -> SSL_DetectionRobot:
    return build(SSL_DetectionRobot, confidence=item.confidence, robot_id=item.id, x=x_mm, y=y_mm,
                 orientation=item.orientation_rad, pixel_x=item.pixel[0], pixel_y=item.pixel[1], height=item.z_mm)
