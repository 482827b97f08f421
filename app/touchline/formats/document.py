"""The content of a calibration file as plain data, whatever it is written in; its bytes alone say what that is.

Mappings, lists, numbers and text. Nothing is evaluated, no reference is followed, and every syntax has limits of size
and depth: any file may have been made to harm.
"""

import io
import json
import math
import re
import struct
import tomllib
import zipfile
import zlib
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any
from xml.parsers import expat

import numpy as np

from touchline.core.errors import BadInput
from touchline.core.json_values import JsonObject
from touchline.core.strict_yaml import MAX_BYTES, MAX_DEPTH, texts_from_yaml
from touchline.formats.numbers import format_error

MAX_FILE_BYTES = 64 << 20  # with the pictures of its board
MAX_TOML_BYTES = 32 * 1024  # a key of n parts takes n² steps
PICTURE = re.compile(rb'"[A-Za-z0-9+/=]{4096,}"')  # in base64, as a JSON string
SOLVED = re.compile(rb""":\s{0,9}b(?:'[^'\n]*'|"[^"\n]*")""")  # what mrcal has solved, compressed
PYTHON = re.compile(rb"""'[^'\n]*'|"[^"\n]*"|\#[^\n]*|[()]""")
NO_SPACE = re.compile(rb"^([ ]*[A-Za-z_][\w.]*):(?=[^\s:/\\])", re.MULTILINE)  # as OpenCV reads it
DIRECTIVE = re.compile(rb"^%YAML[^\n]*\n", re.MULTILINE)
TAGS = frozenset(
    f"tag:yaml.org,2002:{name}"
    for name in ("opencv-matrix", "python/tuple", "float", "int", "str", "seq", "map")
)
COLMAP = re.compile(r"[0-9]+ [A-Z][A-Z_]+ [0-9]+ [0-9]+(?: [-+.0-9eE]+)+")
TOML = re.compile(r"\[\[?[\w.\"'-]+\]\]?\s*$|[\w.-]+\s*=")
JSON = re.compile(rb"\s*(?:\{|\[\s*[\[{\"])")
OST = re.compile(r"#\s*oST version|\[image\]\s*$")
NOT_READ = {
    b"\x80": ("a dump of Python objects", "npz, JSON or YAML"),  # to read it is to run it
    b"MATLAB 5.0 MAT": ("a MAT file", "JSON, with jsonencode"),
    b"\x89HDF": ("an HDF5 file", "JSON or YAML"),
    b"\x93NUMPY": ("one array without a name", "npz, with its matrix and coefficients"),
}
# of an .npz, a zip of .npy members: a member begins with type, order and shape, as Python writes them
NPZ = b"PK\x03\x04"
MAX_MEMBERS = 256
MAX_MEMBER_BYTES = 1 << 14  # a camera's numbers have 200
MAX_VALUES = 1000
NPY = re.compile(
    rb"\x93NUMPY(?:\x01\x00..|[\x02\x03]\x00....)"
    rb"\{'descr': '([<>|=]?(?:f[248]|[iu][1248]))', 'fortran_order': (True|False), "
    rb"'shape': \(((?:[0-9]{1,4}(?:, ?[0-9]{1,4}){0,3})?),?\), ?\}\s*\n",
    re.DOTALL,
)
DAMAGED = (
    zipfile.BadZipFile,
    zlib.error,
    struct.error,
    EOFError,
    OSError,
    OverflowError,
    RuntimeError,
    ValueError,
)
UNPACKED = (zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED)  # as numpy packs
SPACE = b" \t\r\n"
MAX_PLAIN_BYTES = 2 << 20  # of XML and JSON; ssl-vision's settings have 0.4 MB
VAR, VAR_NAME = "Var", "name"  # the elements of ssl-vision's settings, and what they are called by


@dataclass(frozen=True)
class FileContent:
    """syntax: "JSON", "XML", …, for people. contents: each document of a YAML stream; else one."""

    syntax: str
    contents: tuple[Any, ...]

    @property
    def first(self) -> JsonObject:
        """The first document where it is a mapping; else empty."""
        content = self.contents[0] if self.contents else None
        return content if isinstance(content, dict) else {}


def parse(data: bytes) -> FileContent:
    """Return a file's content; BadInput where it is not well formed, or of bytes that are not read."""
    if data.startswith(NPZ):
        return FileContent("npz", (_from_npz(data),))
    for start, (kind, instead) in NOT_READ.items():
        if data.startswith(start):
            raise format_error(f"The file is {kind}, which is not read.", f"Save it as {instead}.")
    data = _as_utf8(data)
    if data.lstrip(SPACE)[:1] == b"<":
        return FileContent("XML", (_from_xml(_limited(data, MAX_PLAIN_BYTES)),))
    if JSON.match(data):
        try:
            return FileContent(
                "JSON", (json.loads(_limited(PICTURE.sub(b'""', data), MAX_PLAIN_BYTES)),)
            )
        except (ValueError, RecursionError) as error:
            if b"'" not in data[:4096]:  # not Python's either
                raise format_error(
                    f"The file is not valid JSON: {str(error)[:99]}.", "Export the file again."
                ) from None
    data = _limited(SOLVED.sub(b": ''", data))
    text = data.decode()
    lines = [line for line in text.splitlines() if line.strip()]
    line = next((line for line in lines if not line.startswith("#")), "")
    if OST.match(lines[0] if lines else "") or OST.match(line):
        return FileContent("oST", (_from_ost(text),))
    if COLMAP.fullmatch(line.strip()):
        return FileContent("COLMAP", (_from_colmap(lines),))
    if TOML.match(line):
        return FileContent("TOML", (_from_toml(_limited(data, MAX_TOML_BYTES)),))
    if line.lstrip()[:1] == "{":  # Python's literals are YAML but for the brackets of tuples
        data = PYTHON.sub(lambda found: {b"(": b"[", b")": b"]"}.get(found[0], found[0]), data)
    plain = NO_SPACE.sub(rb"\1: ", DIRECTIVE.sub(b"", data).replace(b"\t", b"    "))
    return FileContent("YAML", tuple(texts_from_yaml(plain, "The file", TAGS)))


def _as_utf8(data: bytes) -> bytes:
    """Return the text in UTF-8 without a byte order mark, and with line ends of one character."""
    try:
        if data[:2] in (b"\xff\xfe", b"\xfe\xff"):
            data = data.decode("utf-16").encode()
        data = data.removeprefix(b"\xef\xbb\xbf")
        data.decode()
    except UnicodeError:
        raise format_error("The file is not text in UTF-8.", "Save it in UTF-8.") from None
    return data.replace(b"\r\n", b"\n").replace(b"\r", b"\n")


def _limited(data: bytes, most: int = MAX_BYTES) -> bytes:
    if len(data) > most:
        raise format_error(
            f"The file has {len(data)} bytes besides pictures. The limit is {most}.",
            "Use a file with one calibration.",
        )
    return data


def _from_toml(data: bytes) -> JsonObject:
    try:
        return tomllib.loads(data.decode())
    except (tomllib.TOMLDecodeError, RecursionError, ValueError) as error:
        raise format_error(
            f"The file is not valid TOML: {str(error)[:99]}.", "Export the file again."
        ) from None


def _from_colmap(lines: list[str]) -> JsonObject:
    """Return COLMAP's cameras.txt: CAMERA_ID MODEL WIDTH HEIGHT PARAMETERS."""
    cameras: JsonObject = {}
    for line in lines:
        if line.lstrip().startswith("#"):
            continue
        if not COLMAP.fullmatch(line.strip()):
            raise format_error(
                f"A line is not a camera of COLMAP: {line[:60]!r}.", "Export the file again."
            )
        name, model, width, height, *parameters = line.split()
        cameras[name] = {
            "colmap_model": model,
            "width": width,
            "height": height,
            "parameters": parameters,
        }
    return cameras


def _from_ost(text: str) -> JsonObject:
    """Return ROS's oST: sections in brackets, in which a name stands above its numbers."""
    cameras: JsonObject = {}
    size: JsonObject = {}
    camera = size
    title = ""
    for line in (line.strip() for line in text.splitlines()):
        if not line or line.startswith("#"):
            continue
        if line == "[image]":
            camera = size = {}
        elif line.startswith("["):
            camera = cameras[line.strip("[]")] = {
                f"image_{side}": size[side][0] for side in ("width", "height") if size.get(side)
            }
        elif line[0].isalpha():
            title = line.replace(" ", "_")
            camera[title] = []
        elif title in camera:
            camera[title] += line.split()
    return cameras


class _XmlReader:
    """Elements as mappings; one with rows, cols and data, in which numbers are separated by spaces, as a matrix.

    ssl-vision's settings have one element, Var, called by its attribute: of those that repeat, samples of colours, the
    first counts, and a text is preferred to its options.
    """

    def __init__(self) -> None:
        self.root: tuple[str, Any] | None = None
        self._open: list[tuple[str, JsonObject, list[str]]] = []

    def start(self, name: str, attributes: Mapping[str, str]) -> None:
        if len(self._open) > MAX_DEPTH:
            raise format_error(
                f"The file has more than {MAX_DEPTH} levels.", "Use a file with one calibration."
            )
        self._open.append((attributes.get(VAR_NAME, name) if name == VAR else name, {}, []))

    def text(self, text: str) -> None:
        if self._open:
            self._open[-1][2].append(text)

    def end(self, element: str) -> None:
        name, children, texts = self._open.pop()
        text = "".join(texts).strip().strip('"')
        value: Any = text if element == VAR and text else children or text
        if isinstance(children.get("data"), str):
            children["data"] = children["data"].split()
        if not self._open:
            self.root = name, value
        elif name not in (siblings := self._open[-1][1]):
            siblings[name] = value
        elif element not in (VAR, "_"):
            raise format_error(
                f"The element {name[:40]!r} is used twice.", "Use a file with one calibration."
            )


def _from_xml(data: bytes) -> JsonObject:
    """Return an XML file's root by its name; a document type, and with it every entity, is refused."""
    reader, parser = _XmlReader(), expat.ParserCreate("UTF-8")

    def refuse(*_: Any) -> None:
        raise format_error(
            "The file has a document type or entities, which are not read.", "Remove them."
        )

    parser.StartDoctypeDeclHandler = parser.EntityDeclHandler = refuse
    parser.StartElementHandler, parser.EndElementHandler = reader.start, reader.end
    parser.CharacterDataHandler = reader.text
    try:
        parser.Parse(data, True)
    except expat.ExpatError as error:
        raise format_error(
            f"The file is not valid XML: {str(error)[:99]}.", "Export the file again."
        ) from None
    if reader.root is None:
        raise BadInput("The file is empty.", "Send the whole file.", reason="bad-calibration")
    name, value = reader.root
    return {name: value}


def _from_npz(data: bytes) -> JsonObject:
    """Return the numbers of each array of an .npz by name, as nested lists; nothing in it is run.

    Members that are not plain numbers (lists of objects, text) and large ones are passed over.
    """
    try:
        with zipfile.ZipFile(io.BytesIO(data)) as members:
            found = members.infolist()
            if len(found) > MAX_MEMBERS:
                raise format_error(
                    f"The file has {len(found)} arrays. The limit is {MAX_MEMBERS}.",
                    "Save the camera's matrix and coefficients alone.",
                )
            read = {one.filename.removesuffix(".npy"): _npy_member(members, one) for one in found}
    except DAMAGED as error:
        raise format_error(
            f"The file is not a whole npz: {str(error)[:80]}.", "Save it again."
        ) from None
    return {name: value for name, value in read.items() if value is not None}


def _npy_member(members: zipfile.ZipFile, one: zipfile.ZipInfo) -> Any:
    """Return an array's numbers; None where it is not one of numbers, or large."""
    if one.file_size > MAX_MEMBER_BYTES or one.compress_type not in UNPACKED:
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
