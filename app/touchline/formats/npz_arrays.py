"""The arrays of a file that numpy saved, as plain lists: its bytes are read here, and nothing in it is run.

An .npz is a zip of .npy members. A member begins with its type, order and shape as a Python literal, of which only the
plain forms of numbers are read; other members (lists of objects, text) are passed over, as are large ones.
"""

import io
import math
import re
import zipfile
import zlib
from typing import Any

import numpy as np

from touchline.core.json_values import JsonObject
from touchline.formats.numbers import format_error

MAGIC = b"PK\x03\x04"
MAX_MEMBERS = 256
MAX_MEMBER_BYTES = 1 << 14  # a camera's numbers have 200
MAX_VALUES = 1000
NPY = re.compile(
    rb"\x93NUMPY(?:\x01\x00..|[\x02\x03]\x00....)"
    rb"\{'descr': '([<>|=]?[fiu][1248])', 'fortran_order': (True|False), "
    rb"'shape': \(((?:[0-9]{1,4}(?:, ?[0-9]{1,4}){0,3})?),?\), ?\}\s*\n",
    re.DOTALL,
)
DAMAGED = (zipfile.BadZipFile, zlib.error, EOFError, OSError, ValueError, RuntimeError)


def arrays_of(data: bytes) -> JsonObject:
    """Return the numbers of each array by name, as nested lists; BadInput where the file is damaged."""
    try:
        with zipfile.ZipFile(io.BytesIO(data)) as members:
            found = members.infolist()
            if len(found) > MAX_MEMBERS:
                raise format_error(
                    f"The file has {len(found)} arrays. The limit is {MAX_MEMBERS}.",
                    "Save the camera's matrix and coefficients alone.",
                )
            read = {one.filename.removesuffix(".npy"): _member(members, one) for one in found}
    except (*DAMAGED, NotImplementedError) as error:
        raise format_error(
            f"The file is not a whole npz: {str(error)[:80]}.", "Save it again."
        ) from None
    return {name: value for name, value in read.items() if value is not None}


def _member(members: zipfile.ZipFile, one: zipfile.ZipInfo) -> Any:
    """Return an array's numbers; None where it is not one of numbers, or large."""
    if one.file_size > MAX_MEMBER_BYTES:
        return None
    with members.open(one) as file:
        data = file.read(MAX_MEMBER_BYTES + 1)
    header = NPY.match(data)
    if header is None:
        return None
    kind, by_columns, shape = header[1].decode(), header[2] == b"True", header[3].decode()
    sides = tuple(int(side) for side in shape.split(",") if side.strip())
    dtype, numbers = np.dtype(kind), data[header.end() :]
    if math.prod(sides) > MAX_VALUES or len(numbers) != math.prod(sides) * dtype.itemsize:
        return None
    values = np.frombuffer(numbers, dtype).reshape(sides, order="F" if by_columns else "C")
    return values.tolist()
