"""The tables of a PLY file, ASCII or binary, of either byte order."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from o3d_relief.errors import FileError

__all__ = ["Columns", "read_tables"]

_TYPES = {
    **{"char": "i1", "uchar": "u1", "short": "i2", "ushort": "u2", "int": "i4", "uint": "u4"},
    **{"float": "f4", "double": "f8", "float32": "f4", "float64": "f8", "int8": "i1", "uint8": "u1"},
    **{"int16": "i2", "uint16": "u2", "int32": "i4", "uint32": "u4", "int64": "i8", "uint64": "u8"},
}
_TOO_SHORT = "it ends too early, part of it is missing"

Columns = dict[str, NDArray[np.generic]]


@dataclass(frozen=True)
class _Property:
    """A column of an element; `count` is the type of the length of a list, empty for a single number."""

    name: str
    kind: str
    count: str = ""


@dataclass
class _Element:
    """A table of the file; a list column is stored as `name` (all values) and `name#` (the lengths)."""

    name: str
    length: int
    properties: list[_Property] = field(default_factory=list)
    columns: Columns = field(default_factory=dict)


def read_tables(data: bytes) -> tuple[dict[str, Columns], list[str]]:
    r"""Read all tables of a PLY file.

    Parameters
    ----------
    data : bytes
        The file.

    Returns
    -------
    dict of str to dict of str to array
        For each element its columns, in their own types (texts of floats in float64). A list is two
        columns: `name`, all values one after the other, and `name#`, how many each row has.
    list of str
        The textures that comments name.

    Raises
    ------
    FileError
        Not a PLY file, or a damaged one: the reason, without the file's name.

    Examples
    --------
    >>> header = b"ply\nformat ascii 1.0\nelement face 2\nproperty list uchar int corners\nend_header\n"
    >>> read_tables(header + b"2 7 8\n1 9\n")[0]["face"]["corners#"].tolist()
    [2, 1]
    """
    order, elements, textures, start = _read_header(data)
    if order == "ascii":
        _read_ascii(elements, data[start:])
    else:
        _read_binary(elements, data[start:], order)
    return {element.name: element.columns for element in elements}, textures


def _read_header(data: bytes) -> tuple[str, list[_Element], list[str], int]:
    """Return the byte order ("<", ">", "ascii"), the elements, the textures and where the data start."""
    lines = _lines(data)
    if next(lines, ("", 0))[0] != "ply":
        raise FileError("it is not a PLY file")
    orders = {"ascii": "ascii", "binary_little_endian": "<", "binary_big_endian": ">"}
    order = ""
    elements: list[_Element] = []
    textures = []
    for line, end in lines:
        match line.split():
            case ["format", name, _] if name in orders:
                order = orders[name]
            case ["element", name, length] if length.isdecimal():
                elements.append(_Element(name, int(length)))
            case ["property", "list", count, kind, name] if count in _TYPES and kind in _TYPES and elements:
                elements[-1].properties.append(_Property(name, _TYPES[kind], _TYPES[count]))
            case ["property", kind, name] if kind in _TYPES and elements:
                elements[-1].properties.append(_Property(name, _TYPES[kind]))
            case ["comment", "TextureFile", _, *_]:
                textures.append(line.split(None, 2)[2])
            case ["end_header"] if order:
                _check_names(elements)
                return order, elements, textures, end
            case [] | ["comment" | "obj_info", *_]:
                pass
            case _:
                raise FileError(f"its header has a line that no PLY file has, {line[:60]!r}")
    raise FileError("its header has no end")


def _check_names(elements: list[_Element]) -> None:
    for element in elements:
        names = [item.name for item in element.properties]
        if not names or len(set(names)) < len(names):
            raise FileError(f"its element {element.name} has no properties, or two of one name")


def _lines(data: bytes) -> Iterator[tuple[str, int]]:
    """Yield the lines of the header, each with the place where the next one starts."""
    start = 0
    while (end := data.find(b"\n", start)) >= 0:
        yield data[start:end].decode("utf-8", "replace").strip(), end + 1
        start = end + 1


def _read_ascii(elements: list[_Element], data: bytes) -> None:
    try:
        numbers = np.array(data.split(), dtype=np.float64)
    except ValueError:
        raise FileError("it has text where numbers should be") from None
    at = 0
    for element in elements:
        if element.length == 0:
            continue
        width = len(element.properties)
        if element.length * width > len(numbers) - at:
            raise FileError(_TOO_SHORT)
        if not any(item.count for item in element.properties):
            table = numbers[at : at + element.length * width].reshape(element.length, width)
            for i, item in enumerate(element.properties):
                element.columns[item.name] = _cast(table[:, i], item.kind)
            at += element.length * width
        else:
            at = _read_ragged_ascii(element, numbers, at)


def _read_ragged_ascii(element: _Element, numbers: NDArray[np.float64], at: int) -> int:
    """Read a table that has lists, row by row; return where the next one starts."""
    values: dict[str, list[int]] = {item.name: [] for item in element.properties}
    lengths: dict[str, list[int]] = {item.name: [] for item in element.properties if item.count}
    size = len(numbers)
    for _ in range(element.length):
        for item in element.properties:
            count = 1
            if item.count:
                if at >= size or not 0 <= numbers[at] < size - at:
                    raise FileError(_TOO_SHORT)
                count = int(numbers[at])
                lengths[item.name].append(count)
                at += 1
            values[item.name].extend(range(at, at + count))
            at += count
    if at > size:
        raise FileError(_TOO_SHORT)
    for item in element.properties:
        places = np.array(values[item.name], dtype=np.int64)
        element.columns[item.name] = _cast(numbers[places], item.kind)
    for name, counts in lengths.items():
        element.columns[f"{name}#"] = np.array(counts, dtype=np.int64)
    return at


def _cast(numbers: NDArray[np.float64], kind: str) -> NDArray[np.generic]:
    """Give the numbers of a text their type."""
    if kind[0] == "f":
        return numbers
    limits = np.iinfo(kind)
    if not ((numbers >= limits.min) & (numbers <= limits.max)).all():
        raise FileError("it has a number that does not fit its type")
    return numbers.astype(kind)


def _read_binary(elements: list[_Element], data: bytes, order: str) -> None:
    at = 0
    for element in elements:
        if element.length == 0:
            continue
        row, counts = _first_row(element, data, at, order)
        end = at + element.length * row.itemsize
        even = end <= len(data)
        if even:
            table = np.frombuffer(data, dtype=row, count=element.length, offset=at)
            even = all((table[name] == count).all() for name, count in counts.items())
        if not even and not counts:
            raise FileError(_TOO_SHORT)
        if even:
            element.columns = {name: table[name].ravel() for name in row.names or ()}
            at = end
        else:
            at = _read_ragged_binary(element, data, at, order)


def _first_row(
    element: _Element, data: bytes, at: int, order: str
) -> tuple[np.dtype[np.void], dict[str, int]]:
    """Return the layout of the first row and the lengths of its lists."""
    fields: list[tuple[str, str] | tuple[str, str, tuple[int]]] = []
    counts = {}
    for item in element.properties:
        if item.count:
            count, at = _read_count(data, at, order + item.count)
            counts[f"{item.name}#"] = count
            fields += [(f"{item.name}#", order + item.count), (item.name, order + item.kind, (count,))]
            at += count * np.dtype(item.kind).itemsize
        else:
            fields.append((item.name, order + item.kind))
            at += np.dtype(item.kind).itemsize
    return np.dtype(fields), counts


def _read_ragged_binary(element: _Element, data: bytes, at: int, order: str) -> int:
    """Read a table whose lists differ in length, row by row; return where the next one starts."""
    pieces: dict[str, list[bytes]] = {item.name: [] for item in element.properties}
    lengths: dict[str, list[int]] = {item.name: [] for item in element.properties if item.count}
    sizes = {item.name: np.dtype(item.kind).itemsize for item in element.properties}
    for _ in range(element.length):
        for item in element.properties:
            count = 1
            if item.count:
                count, at = _read_count(data, at, order + item.count)
                lengths[item.name].append(count)
            end = at + count * sizes[item.name]
            pieces[item.name].append(data[at:end])
            at = end
    if at > len(data):
        raise FileError(_TOO_SHORT)
    for item in element.properties:
        element.columns[item.name] = np.frombuffer(b"".join(pieces[item.name]), dtype=order + item.kind)
    for name, counts in lengths.items():
        element.columns[f"{name}#"] = np.array(counts, dtype=np.int64)
    return at


def _read_count(data: bytes, at: int, kind: str) -> tuple[int, int]:
    """Read the length of a list; return it and where the list starts."""
    end = at + int(kind[-1])
    count = int.from_bytes(data[at:end], "little" if kind[0] == "<" else "big", signed=kind[1] == "i")
    if end > len(data) or not 0 <= count <= len(data) - end:
        raise FileError(_TOO_SHORT)
    return count, end
