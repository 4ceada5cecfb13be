"""Small files of every format, made in code, and ways to damage them."""

from __future__ import annotations

import json
import struct
from collections.abc import Callable
from io import BytesIO

import numpy as np
import trimesh
from hypothesis import strategies as st
from PIL import Image
from trimesh.visual import TextureVisuals
from trimesh.visual.material import PBRMaterial

from shapes import bust, exploded, hills, joined, moved, sphere

Files = dict[str, bytes]
Edit = tuple[str, float, int]

TOKENS = tuple(
    b"nan inf -inf 1e400 -1e300 1e-320 -0 -1 0 1 3 255 65536 2147483647 2147483648 4294967295 1e9 0x10 "
    b"99999999999999999999 abc \xff\xfe # \\ / // 1//1 -1/-1/-1 list uchar double element face vertex "
    b"property end_header comment usemtl mtllib v f vt facet endsolid COFF ".split(b" ")
)
WORDS = tuple(
    struct.pack(order + kind, value)
    for order in "<>"
    for kind, values in (
        ("f", (float("nan"), float("inf"), 1e38, -1e38, 1e-45, 0.0)),
        ("I", (0, 1, 2**31 - 1, 2**31, 2**32 - 1, 255, 256, 65536)),
        ("d", (float("nan"), float("-inf"), 1e308, 5e-324)),
    )
    for value in values
)
JSON_VALUES = (
    *(None, True, -1, 0, 1, 2, 3, 5, 5120, 5121, 5123, 5125, 5126, 999999, 2**31, 2**63, 1e308, -1e-300, 0.5),
    *("", "SCALAR", "VEC2", "VEC3", "VEC4", "MAT4", "data:,", "data:application/octet-stream;base64,AAAA"),
    *("missing.bin", [], [0], [1, 2, 3], [0.0] * 16, [1e300] * 16, {}, {"TEXCOORD_0": 0}, float("nan")),
)


def _shape() -> tuple[np.ndarray, np.ndarray]:
    return joined(bust(5), moved(hills(4), (0, 0, -60)))


def _ply(order: str, *, colors: str = "", strips: bool = False, uvs: bool = False) -> bytes:
    vertices, faces = _shape()
    name = {"": "ascii", "<": "binary_little_endian", ">": "binary_big_endian"}[order]
    kinds = [(axis, "f4") for axis in "xyz"] + [(axis, "f4") for axis in ("nx", "ny", "nz")]
    kinds += [(channel, colors) for channel in ("red", "green", "blue") if colors]
    rows = np.zeros(len(vertices), dtype=kinds)
    for i, axis in enumerate("xyz"):
        rows[axis] = vertices[:, i]
    rows["nz"] = 1
    if colors:
        rows["green"] = 200
    words = {"f4": "float", "u1": "uchar", "u2": "ushort"}
    header = ["ply", f"format {name} 1.0", "comment TextureFile t.png", f"element vertex {len(rows)}"]
    header += [f"property {words[kind]} {axis}" for axis, kind in kinds]
    if strips:
        flat = np.insert(faces.astype("i4"), 3, -1, axis=1).ravel()
        polygons = [np.array([len(flat)], "i4"), flat]
        header += ["element tristrips 1", "property list int int vertex_indices"]
    else:
        polygons = []
        for face in faces:
            polygons += [np.array([3], "u1"), face.astype("i4")]
            polygons += [np.array([6], "u1"), np.full(6, 0.5, "f4")] if uvs else []
        header += [f"element face {len(faces)}", "property list uchar int vertex_indices"]
        header += ["property list uchar float texcoord"] if uvs else []
    start = "\n".join([*header, "end_header\n"]).encode()
    if order:
        body = b"".join(part.astype(part.dtype.newbyteorder(order)).tobytes() for part in polygons)
        return start + rows.astype(rows.dtype.newbyteorder(order)).tobytes() + body
    lines = [" ".join(f"{value:g}" for value in row.tolist()) for row in rows]
    lines += [" ".join(f"{value:g}" for value in part.tolist()) for part in polygons]
    return start + "\n".join(lines).encode() + b"\n"


def _png() -> bytes:
    stream = BytesIO()
    Image.new("RGB", (2, 2), "red").save(stream, format="PNG")
    return stream.getvalue()


def _obj() -> Files:
    vertices, faces = _shape()
    lines = ["mtllib a.mtl", *("v {} {} {}".format(*row) for row in vertices.round(3))]
    lines += ["vt 0 0", "vt 1 0", "vt 0.5 1", "vn 0 0 1", "usemtl wood"]
    lines += ["f {}/1/1 {}/2/1 {}/3/1".format(*face) for face in (faces + 1)[:-4]]
    lines += ["usemtl red", "f {} {} {} {}".format(*range(1, 5)), "f -1// -2// -3//"]
    library = b"newmtl wood\nKd 1 1 1\nmap_Kd t.png\nnewmtl red\nKd 1 0 0\n"
    return {"t.png": _png(), "a.mtl": library, "a.obj": "\n".join(lines).encode() + b"\n"}


def _off(kind: str) -> bytes:
    vertices, faces = _shape()
    end = " 255 0 9 255" if kind == "COFF" else ""
    lines = [kind, f"{len(vertices)} {len(faces)} 0"]
    lines += ["{:.3f} {:.3f} {:.3f}".format(*row) + end for row in vertices]
    lines += ["3 {} {} {}".format(*face) for face in faces]
    return "\n".join(lines).encode() + b"\n"


def _scene() -> trimesh.Scene:
    first = trimesh.Trimesh(*_shape(), process=False)
    material = PBRMaterial(
        baseColorTexture=Image.new("RGB", (2, 2), "red"), baseColorFactor=[9, 99, 255, 255]
    )
    first.visual = TextureVisuals(uv=np.full((len(first.vertices), 2), 0.25), material=material)
    second = trimesh.Trimesh(*sphere(4), process=False)
    second.visual.vertex_colors = np.full((len(second.vertices), 4), 77, np.uint8)
    scene = trimesh.Scene()
    place = trimesh.transformations.rotation_matrix(0.4, [0, 1, 0], [9, 0, 0])
    scene.add_geometry(first, geom_name="first", node_name="a")
    scene.add_geometry(second, geom_name="second", node_name="b", parent_node_name="a", transform=place)
    return scene


def _gltf() -> Files:
    files = _scene().export(file_type="gltf")
    return {name: content for name, content in files.items() if name != "model.gltf"} | {
        "a.gltf": files["model.gltf"]
    }


def _stl(kind: str) -> bytes:
    content = trimesh.Trimesh(*exploded(_shape()), process=False).export(file_type=kind)
    return content.encode() if isinstance(content, str) else content


SAMPLES: dict[str, Callable[[], Files]] = {
    "ply_ascii": lambda: {"t.png": _png(), "a.ply": _ply("", colors="u1", uvs=True)},
    "ply_little": lambda: {"t.png": _png(), "a.ply": _ply("<", colors="u2", uvs=True)},
    "ply_big": lambda: {"a.ply": _ply(">", colors="u1")},
    "ply_strips": lambda: {"a.ply": _ply(">", strips=True)},
    "ply_strips_ascii": lambda: {"a.ply": _ply("", strips=True)},
    "obj": _obj,
    "stl": lambda: {"a.stl": _stl("stl")},
    "stl_ascii": lambda: {"a.stl": _stl("stl_ascii")},
    "off": lambda: {"a.off": _off("OFF")},
    "coff": lambda: {"a.off": _off("COFF")},
    "glb": lambda: {"a.glb": _scene().export(file_type="glb")},
    "gltf": _gltf,
}
"""Files by name, the main one last."""

_LENGTH = 40


def _swap_lines(data: bytes, at: int, amount: int) -> bytes:
    lines = data.split(b"\n")
    first, second = at % len(lines), amount % len(lines)
    lines[first], lines[second] = lines[second], lines[first]
    return b"\n".join(lines)


def _swap_token(data: bytes, at: int, amount: int) -> bytes:
    words = data.split(b" ")
    words[at % len(words)] = TOKENS[amount % len(TOKENS)]
    return b" ".join(words)


def _put(data: bytes, at: int, piece: bytes, instead_of: int = 0) -> bytes:
    return data[:at] + piece + data[at + instead_of :]


BYTE_EDITS: dict[str, Callable[[bytes, int, int], bytes]] = {
    "flip": lambda d, at, n: _put(d, at, bytes([(d[at] if at < len(d) else 0) ^ (1 << n % 8)]), 1),
    "word": lambda d, at, n: _put(d, at, WORDS[n % len(WORDS)], len(WORDS[n % len(WORDS)])),
    "token": _swap_token,
    "header": lambda d, at, n: _swap_token(d[:400], at, n) + d[400:],
    "lines": _swap_lines,
    "zero": lambda d, at, n: _put(d, at, bytes(n % _LENGTH), n % _LENGTH),
    "cut": lambda d, at, n: d[:at],
    "drop": lambda d, at, n: _put(d, at, b"", 1 + n % _LENGTH),
    "repeat": lambda d, at, n: _put(d, at, d[at : at + 10 * (n % _LENGTH)]),
    "insert": lambda d, at, n: _put(d, at, TOKENS[n % len(TOKENS)]),
}
"""What is done to the bytes of a file, at a place, with a number that says how."""

_edit = st.tuples(
    st.sampled_from([*BYTE_EDITS, "flip", "word", "word", "token", "header", "json", "json", "other"]),
    st.integers(0, 1022).map(lambda step: step / 1023),
    st.integers(0, 1023),
)
edits = st.one_of(st.tuples(_edit), st.tuples(_edit), st.tuples(_edit, _edit), st.tuples(_edit, _edit, _edit))


def edited(files: Files, edit: Edit) -> Files:
    """Return the files with one edit."""
    kind, where, amount = edit
    name = list(files)[-1]
    if kind == "other":  # a file that the main one names
        name = list(files)[amount % len(files)]
        kind = list(BYTE_EDITS)[amount % len(BYTE_EDITS)]
    if name.endswith((".glb", ".gltf")) and kind in ("json", "token", "header"):
        content = _edit_json(files[name], where, amount, binary=name.endswith(".glb"))
    else:
        kind = "word" if kind == "json" else kind
        content = BYTE_EDITS[kind](files[name], int(where * len(files[name])), amount)
    return files | {name: content}


def _edit_json(data: bytes, where: float, amount: int, *, binary: bool) -> bytes:
    """Replace one value of the header of a GLB or glTF file, or drop it."""
    try:
        size = struct.unpack_from("<I", data, 12)[0] if binary else len(data)
        tree = json.loads(data[20 : 20 + size] if binary else data)
    except (struct.error, ValueError):  # damaged by an edit before
        return BYTE_EDITS["flip"](data, int(where * len(data)), amount)
    places: list[tuple[dict | list, str | int]] = []
    queue = [tree]
    while queue:
        node = queue.pop()
        items = node.items() if isinstance(node, dict) else enumerate(node) if isinstance(node, list) else ()
        for key, value in items:
            places.append((node, key))
            queue.append(value)
    if not places:
        return data
    node, key = places[int(where * len(places)) % len(places)]
    if amount % 7 == 0:
        del node[key]
    else:
        node[key] = JSON_VALUES[amount % len(JSON_VALUES)]
    text = json.dumps(tree).encode()
    if not binary:
        return text
    text += b" " * (-len(text) % 4)
    rest = data[20 + size :]
    length = 20 + len(text) + len(rest)
    return struct.pack("<4sIII4s", b"glTF", 2, length, len(text), b"JSON") + text + rest
