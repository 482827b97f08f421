"""One frame from a camera when it is asked for: its source is opened then, and kept open."""

from threading import Lock

from app.images import encode
from app.records import Frame
from app.settings import Settings
from app.sources import Source, Surroundings, source_from_url


class CameraFrames:
    """Cameras by id. Thread-safe; one frame at a time from each."""

    def __init__(self, settings: Settings, around: Surroundings) -> None:
        self._settings = settings
        self._around = around
        self._locks = {camera.id: Lock() for camera in settings.cameras}
        self._sources: dict[str, Source] = {}

    def take(self, id: str) -> tuple[bytes, Frame]:
        """A frame and the PNG that keeps it exactly. A source that fails is opened anew at the next call."""
        camera = self._settings.camera(id)
        with self._locks[id]:
            if id not in self._sources:
                self._sources[id] = source_from_url(camera.source, self._around)
            try:
                frame = self._sources[id].read()
            except BaseException:
                self._sources.pop(id).close()
                raise
        return encode(frame.pixels, "png"), frame

    def close(self) -> None:
        for source in self._sources.values():
            source.close()
        self._sources.clear()
