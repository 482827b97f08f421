"""How much of the disk pictures may take: a quota for all of them, and a reserve for calibrations."""

import shutil
from collections.abc import Callable
from pathlib import Path

from touchline.core.errors import DiskFull
from touchline.core.records import Warning
from touchline.core.statements import join, say

MB = 1_000_000
WARN_FREE_BYTES = 500 * MB
MIN_FREE_BYTES = 100 * MB  # below that a picture is refused: a calibration needs some KB and finds them
UPLOADS_BYTES = 2000 * MB
BACKUPS_BYTES = 1000 * MB


def free_bytes(folder: Path) -> int:
    return shutil.disk_usage(folder).free


class PictureQuota:
    """quota_bytes: for all pictures together. free: returns how much is left on a folder's disk, bytes."""

    def __init__(self, folder: Path, quota_bytes: int = UPLOADS_BYTES,
                 free: Callable[[Path], int] = free_bytes) -> None:
        self._folder = folder
        self._free = free
        self.quota_bytes = quota_bytes
        self.used_bytes = 0

    def count(self, pictures: Path) -> None:
        """Count how much the pictures take."""
        self.used_bytes = sum(path.stat().st_size for path in pictures.iterdir())

    def added(self, size_bytes: int) -> None:
        self.used_bytes += size_bytes

    def over_by(self, size_bytes: int) -> int:
        """Return by how much one more picture would exceed the quota, bytes; not above 0 where it fits."""
        return self.used_bytes + size_bytes - self.quota_bytes

    def check_free(self) -> None:
        """Raise DiskFull where a picture would take what calibrations may need; OSError without the folder."""
        if self._free(self._folder) < MIN_FREE_BYTES:
            raise DiskFull(say("disk.image-refused", "The image was not saved. Less than {free_mb} MB are free on the "
                               "disk.", free_mb=MIN_FREE_BYTES // MB),
                           say("disk.free-space-calibrations", "Free some space on the disk of the data folder, then "
                               "try again. Calibrations can still be saved."))

    def refusal(self) -> DiskFull:
        return DiskFull(say("disk.quota-in-use", "The image was not saved. Images use {used_mb:.0f} MB, and all of "
                            "them are in use.", used_mb=self.used_bytes / MB),
                        say("disk.increase-quota", "Increase uploads_mb in the settings, or download all data and "
                            "start with a new data folder."), reason="uploads-full")

    def warnings(self) -> tuple[Warning, ...]:
        """Return what an operator should know about the disk."""
        free = self._free(self._folder)
        if free >= WARN_FREE_BYTES:
            return ()
        more = say("disk.images-refused", "New images are refused. Calibrations are still saved.")
        return (Warning("disk-nearly-full", join(
            say("disk.nearly-full", "{mb} MB are free on the disk of the data folder.", mb=free // MB),
            more if free < MIN_FREE_BYTES else ""),
                        say("disk.free-some", "Free some space there.")),)
