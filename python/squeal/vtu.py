"""Points and point fields of squeal's .pvtu files and their pieces."""

import base64
import os
import struct
import xml.etree.ElementTree as ElementTree
import zlib

import numpy

TYPES = {"Float32": "<f4", "Float64": "<f8", "Int32": "<i4", "Int64": "<i8", "UInt8": "u1"}


def decode(element):
    """The numbers of a DataArray: text, or base64 of blocks compressed by zlib."""
    text = (element.text or "").strip()
    dtype = TYPES[element.get("type")]
    if element.get("format") == "ascii":
        return numpy.array(text.split(), dtype=float).astype(dtype)
    n_blocks, = struct.unpack("<I", base64.b64decode(text[:8])[:4])
    header_bytes = 4 * (3 + n_blocks)
    header_text = 4 * ((header_bytes + 2) // 3)
    sizes = struct.unpack(f"<{3 + n_blocks}I", base64.b64decode(text[:header_text])[:header_bytes])[3:]
    packed, at, data = base64.b64decode(text[header_text:]), 0, []
    for size in sizes:
        data.append(zlib.decompress(packed[at:at + size]))
        at += size
    return numpy.frombuffer(b"".join(data), dtype=dtype)


def read(path):
    """Points (n, 3) and fields {name: (n,) or (n, components)} of all pieces of a .pvtu file."""
    points, fields = [], {}
    for piece in ElementTree.parse(path).iter("Piece"):
        root = ElementTree.parse(os.path.join(os.path.dirname(path), piece.get("Source"))).getroot()
        for part in root.iter("Piece"):
            if int(part.get("NumberOfCells")) == 0:
                continue
            points.append(decode(next(part.find("Points").iter("DataArray"))).reshape(-1, 3))
            for array in part.find("PointData").iter("DataArray"):
                n = int(array.get("NumberOfComponents", "1"))
                fields.setdefault(array.get("Name"), []).append(decode(array).reshape((-1, n) if n > 1 else -1))
    return numpy.concatenate(points).astype(float), {name: numpy.concatenate(parts) for name, parts in fields.items()}
