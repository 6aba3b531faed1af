"""Files of phase histories and images: header, XML and the parameters of every pulse. The signal is never read.

CPHD 1.1.0 (NGA.STND.0068-1) and CRSD 1.0 (NGA.STND.0080-2) begin with a header of text lines, which says
at which byte each block begins. SICD (NGA.STND.0024) has its XML in a segment of a NITF file.
"""

import os
import stat
from importlib import import_module
from typing import TYPE_CHECKING, Any, BinaryIO, NamedTuple

from bisar_budget.faults import shown
from bisar_budget.formats.document import Element, FormatError, MissingExtraError, parse

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

_END_OF_HEADER = b"\f\n"
_MOST_HEADER = 1 << 16  # bytes; the standard's keys take less than a thousand
_MOST_XML = 1 << 27
_MOST_VECTORS = 1 << 30  # bytes of parameters
_ROOTS = {"CPHD": "CPHD", "CRSDsar": "CRSD", "CRSDtx": "CRSD", "CRSDrcv": "CRSD", "SICD": "SICD"}


class Container(NamedTuple):
    """Parts of a file that are read: its format, its XML with the byte at which that begins, and each block's length.

    `blocks` are (byte, length) by name; empty where the file is XML alone.
    """

    file: str
    format: str
    xml: Element
    xml_data: bytes
    blocks: dict[str, tuple[int, int]]

    @property
    def has_vectors(self) -> bool:
        """Whether there are parameters of pulses beside the XML."""
        return "PVP" in self.blocks

    def vectors(self, block: str, at: int, count: int, dtype: "np.dtype[Any]") -> "NDArray[Any]":
        """Parameters of `count` vectors of a block, from a byte of it on; the rest of the file is not touched."""
        import numpy as np

        start, length = self.blocks[block]
        wanted = count * dtype.itemsize
        if at + wanted > length or wanted > _MOST_VECTORS:
            raise FormatError(
                self.file, f"byte {start}: the {block} block has {length} bytes, {count} vectors need {at + wanted}"
            )
        with open(self.file, "rb") as stream:
            data = _read(stream, self.file, start + at, wanted)
        found: NDArray[Any] = np.frombuffer(data, dtype.newbyteorder(">")).astype(dtype)
        return found


def open_container(file: str) -> Container:
    """Read header and XML of a file.

    Raises
    ------
    FormatError
        It cannot be read, is none of the formats, or is cut off.
    MissingExtraError
        The extra `formats` is not installed.
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
        if size > _MOST_XML:
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
        raise FormatError(
            file, f"byte {start + len(data)}: is cut off here, {length} bytes from {start} on are needed"
        )
    return data


def _with_header(file: str, stream: BinaryIO) -> Container:
    stream.seek(0)
    data = stream.read(_MOST_HEADER)
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
        numbers = [values.get(f"{name}_BLOCK_{what}") for what in ("BYTE_OFFSET", "SIZE")]
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
    if length > _MOST_XML:
        raise FormatError(file, f"byte {start}: XML of {length} bytes is no description of a collection")
    return _of_xml(file, _read(stream, file, start, length), start, blocks)


def _nitf(file: str, stream: BinaryIO) -> Container:
    try:
        jbpy: Any = import_module("jbpy")
    except ImportError:
        raise MissingExtraError from None
    size = os.fstat(stream.fileno()).st_size
    stream.seek(0)
    try:
        read = jbpy.Jbp().load(stream)
        segments = [
            (one["DESDATA"].get_offset(), one["DESDATA"].size)
            for one in read["DataExtensionSegments"]
            if one["subheader"]["DESID"].value.strip() == "XML_DATA_CONTENT"
        ]
        whole = read["FileHeader"]["FL"].value
    except FormatError:
        raise
    except Exception as error:  # whatever a parser of a broken file comes to
        raise FormatError(
            file, f"byte {stream.tell()}: is cut off, or no NITF ({type(error).__name__}: {shown(str(error))})"
        ) from None
    if whole > size:
        raise FormatError(file, f"byte {size}: is cut off here, its header says {whole} bytes")
    for start, length in segments:
        if start + length > size or length > _MOST_XML:
            raise FormatError(file, f"byte {start}: its XML of {length} bytes goes beyond the file, or is none")
        data = _read(stream, file, start, length)
        if b"SICD" in data[:4096]:
            return _of_xml(file, data, start, {})
    raise FormatError(file, f"byte 0: a NITF file without the XML of a SICD, {len(segments)} other segments of XML")
