"""The store that settings describe."""

from touchline.services.saved_shapes import READERS
from touchline.settings import Settings
from touchline.store.files import MB
from touchline.store.store import Store


def open_store(settings: Settings) -> Store:
    """Open the store of the settings' data folder, or of their database."""
    return Store(settings.data, database=settings.database.get_secret_value() if settings.database else None,
                 uploads_bytes=int(settings.storage.uploads_mb * MB),
                 backups_bytes=int(settings.storage.backups_mb * MB), readers=READERS)
