"""PCD, the point clouds of PCL and of many cameras: ASCII, binary and compressed."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from o3d_relief.errors import FileError
from o3d_relief.scene.arrays import CloudArrays

__all__ = ["decode_pcd"]

_TOO_SHORT = "it ends too early, part of it is missing"
_HEADER_ENDS = ("ascii", "binary", "binary_compressed")


@np.errstate(invalid="ignore")  # to float64 go the signalling kinds of NaN, too
def decode_pcd(data: bytes) -> CloudArrays:
    r"""Read a PCD file.

    Parameters
    ----------
    data : bytes
        The file, version 0.5 to 0.7.

    Returns
    -------
    CloudArrays
        Points in the order of the file, those without a measurement not finite. The sensor of an organised
        cloud (of more than one row, as depth cameras give it) is the file's viewpoint; that of a heap of
        points is not believed, since most programs leave it at the origin.

    Raises
    ------
    FileError
        Not a PCD file, or a damaged one: the reason, without the file's name.

    Examples
    --------
    >>> head = "FIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nWIDTH 1\nHEIGHT 1\nPOINTS 1\nDATA ascii\n"
    >>> decode_pcd((head + "1 2 3\n").encode()).points
    array([[1., 2., 3.]])
    """
    header, start = _read_header(data)
    row = _row_type(header)
    count = _whole(header, "POINTS", _whole(header, "WIDTH", 0) * _whole(header, "HEIGHT", 1))
    kind = header["DATA"][0]
    body = data[start:]
    if kind == "ascii":
        table = _from_text(body, row, count)
    else:
        if kind == "binary_compressed":
            body = _decompress(body, count * row.itemsize)
        if count * row.itemsize > len(body):
            raise FileError(_TOO_SHORT)
        table = _from_columns(body, row, count) if kind != "binary" else _from_rows(body, row, count)
    return CloudArrays(
        points=np.stack([table[axis].astype(np.float64) for axis in "xyz"], axis=1),
        colors=_read_colors(table),
        normals=_read_normals(table),
        sensor=_read_sensor(header),
    )


Table = dict[str, NDArray[np.generic]]


def _read_header(data: bytes) -> tuple[dict[str, list[str]], int]:
    """Return the words of each line of the header and where the data start."""
    header: dict[str, list[str]] = {}
    start = 0
    while (end := data.find(b"\n", start)) >= 0:
        words = data[start:end].decode("ascii", "replace").split("#", 1)[0].split()
        start = end + 1
        if not words:
            continue
        name = "FIELDS" if words[0] == "COLUMNS" else words[0]
        if name not in (
            *("VERSION", "FIELDS", "SIZE", "TYPE", "COUNT", "WIDTH", "HEIGHT", "VIEWPOINT", "POINTS", "DATA"),
        ):
            raise FileError(f"its header has a line that no PCD file has, {' '.join(words)[:60]!r}")
        header[name] = words[1:]
        if name == "DATA":
            if words[1:] not in [[kind] for kind in _HEADER_ENDS]:
                raise FileError("its header does not say how the data are written")
            return header, start
    raise FileError("it is not a PCD file, or its header has no end")


def _whole(header: dict[str, list[str]], name: str, default: int) -> int:
    words = header.get(name)
    if words is None:
        return default
    if len(words) != 1 or not words[0].isdecimal():
        raise FileError(f"its header has a {name} that is no whole number")
    return int(words[0])


def _row_type(header: dict[str, list[str]]) -> np.dtype[np.void]:
    """Return the layout of a point; fields without a use get names of their own."""
    names, sizes, types = (header.get(name, []) for name in ("FIELDS", "SIZE", "TYPE"))
    counts = header.get("COUNT", ["1"] * len(names))
    if not len(names) == len(sizes) == len(types) == len(counts) or not {"x", "y", "z"} <= set(names):
        raise FileError("its header does not describe points with x, y and z")
    fields: list[tuple[str, str, tuple[int, ...]]] = []
    for number, (name, size, kind, count) in enumerate(zip(names, sizes, types, counts, strict=True)):
        if kind + size not in ("F4", "F8", "I1", "I2", "I4", "I8", "U1", "U2", "U4", "U8"):
            raise FileError(f"its field {name} has a type that no PCD file has, {kind} {size}")
        if not count.isdecimal() or not 0 < int(count) < 100_000:
            raise FileError(f"its field {name} has a count that is no whole number")
        used = count == "1" and name not in {field[0] for field in fields}
        if name in "xyz" and not used:
            raise FileError("its header does not describe points with x, y and z")
        fields.append((name if used else f"unused {number}", f"<{kind.lower()}{size}", (int(count),)))
    return np.dtype(fields)


def _from_text(body: bytes, row: np.dtype[np.void], count: int) -> Table:
    width = sum(row[name].shape[0] for name in row.names or ())
    words = body.split()
    if count * width > len(words):
        raise FileError(_TOO_SHORT)
    try:
        numbers = np.array(words[: count * width], dtype=np.float64).reshape(count, width)
    except ValueError:
        raise FileError("it has text where numbers should be") from None
    table: Table = {}
    at = 0
    for name in row.names or ():
        kind = row[name].base
        values = numbers[:, at]
        at += row[name].shape[0]
        if kind.kind != "f":
            limits = np.iinfo(kind)
            if not ((values >= limits.min) & (values <= limits.max)).all():
                raise FileError("it has a number that does not fit its type")
        # Colours are packed into the bits of a float32; coordinates keep the digits of the text.
        table[name] = values if name in "xyz" else _cast(values, kind)
    return table


def _cast(values: NDArray[np.float64], kind: np.dtype[np.generic]) -> NDArray[np.generic]:
    with np.errstate(over="ignore"):
        return values.astype(kind)


def _from_rows(body: bytes, row: np.dtype[np.void], count: int) -> Table:
    rows = np.frombuffer(body, dtype=row, count=count)
    return {name: rows[name][:, 0] for name in row.names or ()}


def _from_columns(body: bytes, row: np.dtype[np.void], count: int) -> Table:
    table: Table = {}
    at = 0
    for name in row.names or ():
        kind, size = row[name].base, row[name].shape[0]
        table[name] = np.frombuffer(body, dtype=kind, count=count * size, offset=at)[::size]
        at += count * row[name].itemsize
    return table


def _decompress(body: bytes, length: int) -> bytes:
    """Undo the LZF compression of the data: two sizes, then runs of literals and back references."""
    packed, whole = (int.from_bytes(body[at : at + 4], "little") for at in (0, 4))
    data = body[8 : 8 + packed]
    if len(data) < packed or len(body) < 8:
        raise FileError(_TOO_SHORT)
    if whole != length:
        raise FileError("its compressed data have another size than its header says")
    result = bytearray()
    at = 0
    try:
        while at < packed:
            control = data[at]
            at += 1
            if control < 32:  # a run of control + 1 literals
                result += data[at : at + control + 1]
                at += control + 1
                continue
            size = control >> 5
            if size == 7:
                size += data[at]
                at += 1
            start = len(result) - ((control & 31) << 8) - data[at] - 1
            at += 1
            if start < 0 or len(result) + size + 2 > length:
                raise FileError("its compressed data are damaged")
            for place in range(start, start + size + 2):  # may overlap with what it writes
                result.append(result[place])
    except IndexError:
        raise FileError("its compressed data are damaged") from None
    if len(result) != length:
        raise FileError("its compressed data are damaged")
    return bytes(result)


def _read_colors(table: Table) -> NDArray[np.float64] | None:
    """Return colours from 0 to 1; they are packed into the bits of one number."""
    packed = table.get("rgb", table.get("rgba"))
    if packed is None or packed.dtype.itemsize != 4:
        return None
    bits = np.ascontiguousarray(packed).view("<u4")
    return np.stack([(bits >> shift & 255) / 255.0 for shift in (16, 8, 0)], axis=1)


def _read_normals(table: Table) -> NDArray[np.float64] | None:
    names = ("normal_x", "normal_y", "normal_z")
    if not all(name in table for name in names):
        return None
    return np.stack([table[name].astype(np.float64) for name in names], axis=1)


def _read_sensor(header: dict[str, list[str]]) -> tuple[float, float, float] | None:
    if _whole(header, "HEIGHT", 1) < 2 or _whole(header, "WIDTH", 0) < 2:
        return None
    try:
        x, y, z = (float(word) for word in header.get("VIEWPOINT", ["0", "0", "0"])[:3])
    except ValueError:
        raise FileError("its header has a VIEWPOINT that is no point") from None
    return (x, y, z)
