"""Reading the .pvtu files that the program writes, without any library."""

import base64
import struct
import xml.etree.ElementTree as ElementTree
import zlib


def numbers(element):
    """The numbers of a DataArray: base64 of blocks compressed by zlib."""
    text = element.text.strip()
    code = {"Float32": "f", "Float64": "d", "Int32": "i"}[element.get("type")]
    n_blocks, = struct.unpack("<I", base64.b64decode(text[:8])[:4])
    header = 4 * ((4 * (3 + n_blocks) + 2) // 3)
    sizes = struct.unpack(f"<{3 + n_blocks}I", base64.b64decode(text[:header])[:4 * (3 + n_blocks)])[3:]
    packed, data, at = base64.b64decode(text[header:]), b"", 0
    for size in sizes:
        data += zlib.decompress(packed[at:at + size])
        at += size
    return [x for x, in struct.iter_unpack("<" + code, data)]


def pieces(record):
    """For each piece with cells of a .pvtu file: the piece, its arrays by name, its points' coordinates in a row."""
    for piece in ElementTree.parse(record).iter("Piece"):
        for part in ElementTree.parse(record.parent / piece.get("Source")).getroot().iter("Piece"):
            if int(part.get("NumberOfCells")) == 0:
                continue
            arrays = {array.get("Name"): array for array in part.iter("DataArray")}
            yield part, arrays, numbers(next(part.find("Points").iter("DataArray")))
