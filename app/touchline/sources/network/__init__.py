"""Network cameras: HTTP, MJPEG and RTSP, to pinned addresses only."""
