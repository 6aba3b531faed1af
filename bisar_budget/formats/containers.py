"""Reading of the header, the XML and the parameters of the pulses from radar files; the signal is never read.

CPHD 1.1.0 (NGA.STND.0068-1) and CRSD 1.0 (NGA.STND.0080-2) begin with a header of text lines, which gives the byte at
which each block begins. SICD (NGA.STND.0024) has its XML in a segment of a NITF file. XML with entities, or with
references to other files, is refused. An error message names the path of the faulty element in the document.
"""

import math
import os
import stat
from dataclasses import dataclass
from importlib import import_module
from typing import TYPE_CHECKING, BinaryIO

import numpy as np

from bisar_budget.arrays import Records
from bisar_budget.extras import MissingExtraError, install_command
from bisar_budget.faults import printable, shown
from bisar_budget.geometry import Vector
from bisar_budget.paths.earth import Floats

if TYPE_CHECKING:
    from lxml.etree import _Element


_MAX_POLYNOMIAL_ORDER = 30  # a higher order was not fitted to data
_INCLUDE = "{http://www.w3.org/2001/XInclude}"


class FormatError(Exception):
    """A radar file cannot be used. The message names the file, and the byte or the XML path of the problem."""

    def __init__(self, file: str, problem: str) -> None:
        super().__init__(f"{printable(file)}: {problem}")


def _missing() -> MissingExtraError:
    return MissingExtraError(f"bisar-budget reads and writes radar formats with sarkit: {install_command('formats')}")


def check_extra() -> None:
    """Raise `MissingExtraError` unless the optional dependencies `formats` (lxml, sarkit) can be imported."""
    try:
        for module in ("lxml.etree", "sarkit", "sarkit.cphd"):
            import_module(module)
    except ImportError:
        raise _missing() from None


class Element:
    """An element of the XML document of a radar file, with methods that find and convert elements below it.

    The methods take paths relative to the element, in the syntax of ElementPath but without namespaces, such as
    `Channel/Parameters/FxC`.
    """

    def __init__(self, file: str, node: "_Element") -> None:
        self.file, self.node = file, node

    @property
    def tag(self) -> str:
        """Name of the element without its namespace."""
        return str(self.node.tag).rpartition("}")[2]

    @property
    def namespace(self) -> str:
        """XML namespace of the element, which contains the version of the format; empty if it has none."""
        return str(self.node.tag).rpartition("}")[0].lstrip("{")

    @property
    def path(self) -> str:
        """Path of the element from the root of the document, such as `/CPHD/Channel/Parameters[2]`."""
        steps = []
        node = self.node
        while node is not None:
            name = str(node.tag).rpartition("}")[2]
            parent = node.getparent()
            siblings = [child for child in parent if child.tag == node.tag] if parent is not None else [node]
            steps.append(name if len(siblings) == 1 else f"{name}[{siblings.index(node) + 1}]")
            node = parent
        return "/" + "/".join(reversed(steps))

    def fault(self, problem: str, below: str = "") -> FormatError:
        """Make an error whose message names the file, the problem, and this element or the path `below` it."""
        return FormatError(self.file, f"{self.path}{'/' + below if below else ''} {problem}")

    def all(self, path: str) -> list["Element"]:
        """All elements at a path below this element; empty if there are no such elements."""
        return [Element(self.file, node) for node in self.node.findall(_any_namespace(path))]

    def maybe(self, path: str) -> "Element | None":
        """First element at a path, or None if there is no such element; an empty path gives this element itself."""
        node = self.node.find(_any_namespace(path)) if path else self.node
        return None if node is None else Element(self.file, node)

    def one(self, path: str) -> "Element":
        """First element at a path; raises `FormatError` if the path has no element."""
        element = self.maybe(path)
        if element is None:
            raise self.fault("is missing", path)
        return element

    def with_child(self, path: str, child: str, text: str) -> "Element | None":
        """First element at a path with a child `child` that has the text `text`; None if there is no such element."""
        return next(
            (element for element in self.all(path) if element.maybe(child) and element.text(child) == text), None
        )

    def text(self, path: str = "") -> str:
        """Text of the element at a path, without leading and trailing spaces."""
        return (self.one(path).node.text or "").strip()

    def number(self, path: str = "") -> float:
        """Read the number at a path; raises `FormatError` if it is not finite."""
        text = self.text(path)
        try:
            value = float(text)
        except ValueError:
            value = math.nan
        if not math.isfinite(value):
            raise self.fault(f"must be a finite number (got {shown(text)!r})", path)
        return value

    def whole(self, path: str = "") -> int:
        """Read the integer at a path; raises `FormatError` if it is below 0."""
        text = self.text(path)
        if not (text.isascii() and text.isdigit() and len(text) < 19):
            raise self.fault(f"must be a whole number from 0 on (got {shown(text)!r})", path)
        return int(text)

    def vector(self, path: str = "") -> Vector:
        """Read the vector at a path from its child elements X, Y and Z."""
        node = self.one(path)
        return (node.number("X"), node.number("Y"), node.number("Z"))

    def polynomial(self, path: str = "", variables: int = 1) -> Floats:
        """Read the coefficients of a polynomial at a path, as an array with one axis for each variable.

        The shape is (order + 1,) for one variable, and (order1 + 1, order2 + 1) for two.
        """
        node = self.one(path)
        numbers = range(1, variables + 1)
        coefficients = np.zeros([node._attribute(f"order{number}", _MAX_POLYNOMIAL_ORDER) + 1 for number in numbers])
        for coefficient in node.all("Coef"):
            powers = tuple(coefficient._attribute(f"exponent{number}", _MAX_POLYNOMIAL_ORDER) for number in numbers)
            if any(power >= size for power, size in zip(powers, coefficients.shape, strict=True)):
                raise coefficient.fault("is of a higher power than the polynomial's order")
            coefficients[powers] = coefficient.number()
        return coefficients

    def path_polynomial(self, path: str) -> Floats:
        """Read the coefficients of a position as polynomials of time, (order + 1, 3), with the columns X, Y and Z."""
        axes = [self.one(path).polynomial(axis) for axis in "XYZ"]
        most = max(axis.size for axis in axes)
        return np.stack([np.pad(axis, (0, most - axis.size)) for axis in axes], axis=1)

    def matrix(self, path: str, size: int) -> Floats:
        """Read a symmetric matrix (size, size) from the `Entry` elements at a path.

        The file may state only one of the two equal entries (i, j) and (j, i). Entries that it does not state are 0.
        """
        entries = np.full((size, size), np.nan)
        for entry in self.one(path).all("Entry"):
            row, column = (entry._attribute(name, size) - 1 for name in ("index1", "index2"))
            if min(row, column) < 0:
                raise entry.fault("counts its indices from 1")
            entries[row, column] = entry.number()
        filled = np.where(np.isnan(entries), entries.T, entries)
        symmetric: Floats = np.nan_to_num(filled / 2 + filled.T / 2)
        return symmetric

    def _attribute(self, name: str, most: int) -> int:
        text = self.node.get(name, "")
        if not (text.isascii() and text.isdigit() and int(text[:9]) <= most):
            raise self.fault(f"must have {name} from 0 to {most} (got {shown(text)!r})")
        return int(text)


def _any_namespace(path: str) -> str:
    return "/".join(f"{{*}}{step}" for step in path.split("/"))


def parse(file: str, data: bytes, start: int = 0) -> Element:
    """Parse `data`, the XML document that begins at the byte `start` of a file, and return its root element.

    Raises
    ------
    FormatError
        The data are not XML, or have a document type, entities or references to other files.
    """
    try:
        from lxml import etree
    except ImportError:
        raise _missing() from None
    for word in (b"<!DOCTYPE", b"<!ENTITY"):  # before a parser sees them
        position = data.find(word)
        if position >= 0:
            raise FormatError(
                file, f"byte {start + position}: XML with {word.decode()} is refused: entities are not read"
            )
    refused = dict.fromkeys(("resolve_entities", "load_dtd", "huge_tree"), False)
    parser = etree.XMLParser(no_network=True, remove_comments=True, remove_pis=True, **refused)
    try:
        root = etree.fromstring(data.strip(b" \r\n\t\0"), parser)
    except (etree.XMLSyntaxError, ValueError) as error:
        line, column = getattr(error, "position", (0, 0))
        problem = f"byte {start}: no readable XML begins here, line {line}, column {column} of it"
        raise FormatError(file, f"{problem}: {shown(str(error))}") from None
    if root.getroottree().docinfo.doctype:  # in an encoding that hid it
        raise FormatError(file, f"byte {start}: XML with a document type is refused: entities are not read")
    for node in root.iter(f"{_INCLUDE}*"):
        raise Element(file, node).fault("refers to another file, which is not read")
    return Element(file, root)


# ---------------------------------------------------------------------- containers of the XML
_END_OF_HEADER = b"\f\n"
_MAX_HEADER_BYTES = 1 << 16  # the standard's keys take less than a thousand
_MAX_XML_BYTES = 1 << 27
_MAX_VECTOR_BYTES = 1 << 30  # of the parameters of all vectors
_ROOTS = {"CPHD": "CPHD", "CRSDsar": "CRSD", "CRSDtx": "CRSD", "CRSDrcv": "CRSD", "SICD": "SICD"}


@dataclass(frozen=True)
class Container:
    """Format and XML of a radar file, and the positions of its binary blocks.

    `blocks` maps the name of a block to its first byte and its length in bytes; it is empty if the file is only XML.
    """

    file: str
    format: str
    xml: Element
    xml_data: bytes
    blocks: dict[str, tuple[int, int]]

    @property
    def has_vectors(self) -> bool:
        """Whether the file has a block with the parameters of the pulses (PVP)."""
        return "PVP" in self.blocks

    def vectors(self, block: str, offset: int, count: int, dtype: np.dtype[np.void]) -> Records:
        """Read the parameters of `count` pulses from a block, beginning at `offset` bytes from its start."""
        start, length = self.blocks[block]
        needed = count * dtype.itemsize
        if offset + needed > length or needed > _MAX_VECTOR_BYTES:
            raise FormatError(
                self.file,
                f"byte {start}: the {block} block has {length} bytes, {count} vectors need {offset + needed}",
            )
        with open(self.file, "rb") as stream:
            data = _read(stream, self.file, start + offset, needed)
        vectors: Records = np.frombuffer(data, dtype.newbyteorder(">")).astype(dtype)
        return vectors


def open_container(file: str) -> Container:
    """Read the header and the XML of a radar file.

    Raises `FormatError` if the file cannot be read, has an unknown format, or is cut off.
    """
    try:
        if not stat.S_ISREG(os.stat(file).st_mode):  # a pipe would wait for ever
            raise FormatError(file, "is no regular file")
        with open(file, "rb") as stream:
            return _opened(file, stream)
    except OSError as error:
        raise FormatError(file, f"cannot be read: {error.strerror}") from None
    except ValueError:  # a NUL in the name
        raise FormatError(file, "is no name of a file") from None


def _opened(file: str, stream: BinaryIO) -> Container:
    begin = stream.read(64)
    if begin.startswith((b"CPHD/", b"CRSDsar/", b"CRSDtx/", b"CRSDrcv/")):
        return _with_header(file, stream)
    if begin.startswith(b"NITF"):
        return _nitf(file, stream)
    if begin.lstrip(b"\xef\xbb\xbf \r\n\t").startswith(b"<"):
        size = os.fstat(stream.fileno()).st_size
        if size > _MAX_XML_BYTES:
            raise FormatError(file, f"XML of {size} bytes is no description of a collection")
        data = _read(stream, file, 0, size)
        return _of_xml(file, data, 0, {})
    raise FormatError(
        file, f"byte 0: begins with {shown(ascii(begin[:8])[1:])}: no CPHD, CRSD or SICD; accepted too: their XML"
    )


def _of_xml(file: str, data: bytes, start: int, blocks: dict[str, tuple[int, int]]) -> Container:
    xml = parse(file, data, start)
    if xml.tag not in _ROOTS:
        raise FormatError(file, f"byte {start}: XML of {shown(xml.tag)}, accepted: {', '.join(_ROOTS)}")
    version = xml.namespace.rpartition("/")[2].rpartition(":")[2]
    return Container(file, f"{_ROOTS[xml.tag]} {shown(version)}", xml, data, blocks)


def _read(stream: BinaryIO, file: str, start: int, length: int) -> bytes:
    stream.seek(start)
    data = stream.read(length)
    if len(data) < length:
        end = start + len(data)
        raise FormatError(file, f"byte {end}: is cut off here, {length} bytes from {start} on are needed")
    return data


def _with_header(file: str, stream: BinaryIO) -> Container:
    stream.seek(0)
    data = stream.read(_MAX_HEADER_BYTES)
    end = data.find(_END_OF_HEADER)
    if end < 0:
        raise FormatError(file, f"byte {len(data)}: is cut off here, or its header does not end")
    values: dict[str, str] = {}
    for line in data[:end].split(b"\n")[1:]:
        key, is_pair, value = line.partition(b" := ")
        if line and not is_pair:
            raise FormatError(file, f"byte {data.find(line)}: a line of the header is not KEY := VALUE")
        values[key.decode("ascii", "replace")] = value.decode("ascii", "replace").strip()
    size = os.fstat(stream.fileno()).st_size
    blocks = {}
    for name in ("XML", "PVP", "PPP", "SUPPORT", "SIGNAL"):
        numbers = [values.get(f"{name}_BLOCK_{field}") for field in ("BYTE_OFFSET", "SIZE")]
        if numbers == [None, None]:
            continue
        if not all(text and text.isascii() and text.isdigit() and len(text) < 19 for text in numbers):
            raise FormatError(
                file, f"byte 0: the header does not say where its {name} block begins and how long it is"
            )
        start, length = (int(text or 0) for text in numbers)
        if start + length > size:
            raise FormatError(
                file, f"byte {size}: is cut off here, its {name} block goes from byte {start} to {start + length}"
            )
        blocks[name] = (start, length)
    if "XML" not in blocks:
        raise FormatError(file, "byte 0: the header names no XML block")
    start, length = blocks["XML"]
    if length > _MAX_XML_BYTES:
        raise FormatError(file, f"byte {start}: XML of {length} bytes is no description of a collection")
    return _of_xml(file, _read(stream, file, start, length), start, blocks)


def _nitf(file: str, stream: BinaryIO) -> Container:
    try:
        jbpy = import_module("jbpy")
    except ImportError:
        raise _missing() from None
    size = os.fstat(stream.fileno()).st_size
    stream.seek(0)
    try:
        nitf = jbpy.Jbp().load(stream)
        segments = [
            (segment["DESDATA"].get_offset(), segment["DESDATA"].size)
            for segment in nitf["DataExtensionSegments"]
            if segment["subheader"]["DESID"].value.strip() == "XML_DATA_CONTENT"
        ]
        stated_size = nitf["FileHeader"]["FL"].value
    except Exception as error:  # a parser of a broken file may raise any error
        reason = f"{type(error).__name__}: {shown(str(error))}"
        raise FormatError(file, f"byte {stream.tell()}: is cut off, or no NITF ({reason})") from None
    if stated_size > size:
        raise FormatError(file, f"byte {size}: is cut off here, its header says {stated_size} bytes")
    for start, length in segments:
        if start + length > size or length > _MAX_XML_BYTES:
            raise FormatError(file, f"byte {start}: its XML of {length} bytes goes beyond the file, or is none")
        data = _read(stream, file, start, length)
        if b"SICD" in data[:4096]:
            return _of_xml(file, data, start, {})
    raise FormatError(file, f"byte 0: a NITF file without the XML of a SICD, {len(segments)} other segments of XML")
