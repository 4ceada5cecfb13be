"""The table of the README: what survives in which format."""

from pathlib import Path

import numpy as np
import open3d as o3d
import pytest
import trimesh
from PIL import Image
from trimesh.visual import TextureVisuals
from trimesh.visual.material import PBRMaterial

from o3d_relief.scene.read import READABLE, read_mesh
from o3d_relief.scene.write import WRITABLE, write_mesh

CORNERS = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0.0]])
COLUMNS = ("colours", "UVs", "textures", "normals", "nodes")


def table():
    """Return {format: {column: {"read", "write"}}}, and the column that tells the numbers."""
    text = (Path(__file__).parents[2] / "README.md").read_text(encoding="utf-8")
    lines = text[text.index("| format | colours |") :].split("\n\n")[0].splitlines()
    head, *rows = ([cell.strip() for cell in line.strip("|").split("|")] for line in lines)
    assert tuple(head[1:6]) == COLUMNS
    return {
        row[0].split()[0]: {
            column: set(cell.split(", ")) - {"–"} for column, cell in zip(head[1:6], row[1:6], strict=True)
        }
        | {"numbers": row[6]}
        for row in rows[1:]
    }


TABLE = table()


def kept(mesh):
    return {
        "colours": mesh.has_vertex_colors(),
        "UVs": mesh.has_triangle_uvs(),
        "textures": mesh.has_textures(),
        "normals": mesh.has_vertex_normals(),
    }


def full_mesh():
    mesh = o3d.geometry.TriangleMesh(
        o3d.utility.Vector3dVector(CORNERS / 3), o3d.utility.Vector3iVector([[0, 1, 2]])
    )
    mesh.vertex_colors = o3d.utility.Vector3dVector(CORNERS)
    mesh.vertex_normals = o3d.utility.Vector3dVector(np.tile([0.0, 0.0, 1.0], (3, 1)))
    mesh.triangle_uvs = o3d.utility.Vector2dVector(CORNERS[:, :2])
    mesh.textures = [o3d.geometry.Image(np.full((2, 2, 3), 9, np.uint8))]
    mesh.triangle_material_ids = o3d.utility.IntVector([0])
    return mesh


def foreign_file(folder, form):
    """Write a file with all that its format can have, not by our own writer where that leaves out some."""
    path = folder / f"a.{form.lower()}"
    Image.new("RGB", (2, 2), "red").save(folder / "t.png")
    if form in ("GLB", "glTF"):
        triangle = trimesh.Trimesh(CORNERS, [[0, 1, 2]], process=False)
        material = PBRMaterial(baseColorTexture=Image.new("RGB", (2, 2), "red"))
        triangle.visual = TextureVisuals(uv=CORNERS[:, :2], material=material)
        triangle.visual.vertex_attributes["color"] = np.full((3, 4), 90, np.uint8)
        scene = trimesh.Scene()
        scene.add_geometry(triangle, node_name="a", geom_name="g")
        scene.graph.update("b", geometry="g", matrix=trimesh.transformations.translation_matrix([0, 0, 5]))
        export = {"GLB": trimesh.exchange.gltf.export_glb, "glTF": trimesh.exchange.gltf.export_gltf}[form]
        content = export(scene, include_normals=True)
        for name, part in (content if form == "glTF" else {"a.glb": content}).items():
            (folder / name.replace("model.gltf", "a.gltf")).write_bytes(part)
    elif form == "PLY":
        names = ["x", "y", "z", "nx", "ny", "nz", "red", "green", "blue", "s", "t"]
        header = ["ply", "format ascii 1.0", "comment TextureFile t.png", "element vertex 3"]
        header += [f"property float {name}" for name in names] + ["element face 1"]
        header += ["property list uchar int vertex_indices", "end_header"]
        rows = [f"{x} {y} {z} 0 0 1 0.5 0.5 0.5 {x} {y}" for x, y, z in CORNERS]
        path.write_text("\n".join([*header, *rows, "3 0 1 2", ""]))
    elif form == "OFF":
        rows = [f"{x} {y} {z} 0 0 1 9 99 200 255" for x, y, z in CORNERS]
        path.write_text("\n".join(["CNOFF", "3 1 0", *rows, "3 0 1 2", ""]))
    else:
        write_mesh(path, full_mesh())
    return path


def test_every_format_has_its_row():
    assert sorted(TABLE) == sorted(
        ending[1:].upper().replace("GLTF", "glTF") for ending in set(READABLE) | set(WRITABLE)
    )


@pytest.mark.parametrize("form", TABLE)
def test_read(tmp_path, form):
    mesh = read_mesh(foreign_file(tmp_path, form))
    for column, found in kept(mesh).items():
        assert found == ("read" in TABLE[form][column]), column
    if "read" in TABLE[form]["nodes"]:
        assert sorted(np.asarray(mesh.vertices)[:, 2]) == [0, 0, 0, 5, 5, 5]


@pytest.mark.parametrize("form", TABLE)
def test_written(tmp_path, form):
    path = tmp_path / f"a.{form.lower()}"
    written = {column for column in COLUMNS if "write" in TABLE[form][column]}
    if path.suffix not in WRITABLE:
        assert written == set()
        assert TABLE[form]["numbers"] == "–"
        return
    write_mesh(path, full_mesh())
    if form == "STL":  # the normals of the faces, which no reader takes as those of the vertices
        assert np.frombuffer(path.read_bytes(), "<f4", 3, 84).tolist() == [0, 0, 1]
        assert written == {"normals"}
    else:
        assert {column for column, found in kept(read_mesh(path)).items() if found} == written
    exact = np.array_equal(np.asarray(read_mesh(path).vertices), CORNERS / 3)
    assert TABLE[form]["numbers"] == ("float64, exact" if exact else "float32")
    np.testing.assert_allclose(np.asarray(read_mesh(path).vertices), CORNERS / 3, rtol=1e-7)
