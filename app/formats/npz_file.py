"""A remap table for numpy and OpenCV: ten lines correct a picture without Touchline (see the manual)."""

import io
import json

import numpy as np

from app.core.records import Calibration
from app.formats import Format
from app.imaging.correction import correction_map
from app.models import field_from_raw
from app.models.restored import model_of

GRID_STEP_PX = 8  # field positions are given on a grid; between its nodes a bilinear look-up is good to 0.1 px


def write(calibration: Calibration) -> bytes:
    """Arrays: raw_x, raw_y (h, w) float32 px for cv2.remap; field_mm (rows, columns, 2) float32 at
    raw pixels grid_x, grid_y; image_size, corrected_size; about, the calibration's names as JSON text."""
    model = model_of(calibration)
    table = correction_map(model)
    width, height = calibration.image_size
    grid_x, grid_y = (np.append(np.arange(0, n - 1, GRID_STEP_PX), n - 1).astype(float) for n in (width, height))
    field_mm = field_from_raw(model, np.stack(np.meshgrid(grid_x, grid_y), axis=-1))
    about = {"id": calibration.id, "version": calibration.version, "camera": calibration.camera,
             "field": calibration.field["name"], "region": calibration.region, "rotate": calibration.rotate,
             "model": calibration.model_name, "created_at": calibration.created_at, "software": calibration.software}
    buffer = io.BytesIO()
    np.savez_compressed(buffer, raw_x=table.raw_x, raw_y=table.raw_y, field_mm=field_mm.astype(np.float32),
                        grid_x=grid_x.astype(np.float32), grid_y=grid_y.astype(np.float32),
                        image_size=np.array([width, height]), corrected_size=np.array(table.raw_x.shape[::-1]),
                        about=np.array(json.dumps(about)))
    return buffer.getvalue()


FORMAT = Format("Remap table (numpy)", "application/octet-stream", ".npz",
                "Every model, as a table that corrects pictures; cannot be read back.", write)
