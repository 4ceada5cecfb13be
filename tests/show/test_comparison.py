import numpy as np
import open3d as o3d
import pytest

from o3d_relief.errors import MeshError, ParameterError
from o3d_relief.show.comparison import comparison_sheet
from shapes import grid, sphere, to_mesh


@pytest.fixture(scope="module")
def meshes():
    return {"ball": to_mesh(sphere(8)), "sheet": to_mesh(grid(3))}


def test_a_column_for_each_mesh_and_a_row_for_each_side(meshes):
    one = comparison_sheet(meshes, panel=(50, 50))
    two = comparison_sheet(meshes, (0.0, 30.0), panel=(50, 50))
    assert np.array_equal(comparison_sheet(meshes, np.array([0.0, 30.0]), panel=(50, 50)), two)
    assert one.dtype == np.uint8
    assert two.shape[0] > one.shape[0] + 25
    assert two.shape[1] > one.shape[1]  # the labels of the rows


def test_scale_is_common(meshes):
    small = {"ball": meshes["ball"], "small": to_mesh(sphere(8, radius=25.0))}
    sheet = comparison_sheet(small, panel=(100, 100)).astype(int)
    body = sheet[-100:]  # without the titles
    paper = body[0, 0]
    rows = [
        (np.abs(half - paper).sum(axis=2) > 30).any(axis=1).sum() for half in (body[:, :100], body[:, -100:])
    ]
    assert rows[0] == pytest.approx(2 * rows[1], abs=3)


def test_panels_are_no_wider_than_the_views(meshes):
    flat = to_mesh((grid(3)[0] * np.array([1.0, 0.2, 1.0]), grid(3)[1]))
    assert comparison_sheet({"a": flat}, panel=(100, 100)).shape[0] < 60
    plated = comparison_sheet({"a": flat}, plates=["a"], panel=(100, 100))
    assert plated.shape[0] > comparison_sheet({"a": flat}, panel=(100, 100)).shape[0]


@pytest.mark.parametrize("factor", [10.0, 1e-3])
def test_other_units_are_refused(meshes, factor):
    other = to_mesh(sphere(8)).scale(factor, (0.0, 0.0, 0.0))
    names = (
        "'ball' is 100 large and 'other' 0.1"
        if factor < 1.0
        else "'other' is 1000 large and '(ball|sheet)' 100"
    )
    with pytest.raises(ParameterError, match=f"{names}: give meshes in one unit, and less than ten times"):
        comparison_sheet({**meshes, "other": other}, panel=(50, 50))


def test_sizes_of_one_unit_are_not_refused(meshes):
    other = to_mesh(sphere(8)).scale(0.11, (0.0, 0.0, 0.0))
    assert comparison_sheet({**meshes, "other": other}, panel=(50, 50)).shape[1] == 166


def test_vertices_that_no_face_uses_do_not_count(meshes):
    places, faces = sphere(8)
    stray = to_mesh((np.vstack([places, [[1e5, 0, 0]]]), faces))
    assert np.array_equal(
        comparison_sheet({"a": stray, "b": meshes["sheet"]}, panel=(50, 50)),
        comparison_sheet({"a": meshes["ball"], "b": meshes["sheet"]}, panel=(50, 50)),
    )


def test_errors(meshes):
    with pytest.raises(ParameterError, match="needs a mesh and a view"):
        comparison_sheet({})
    with pytest.raises(ParameterError, match="needs a mesh and a view"):
        comparison_sheet(meshes, ())
    with pytest.raises(ParameterError, match=r"among ball, sheet\. Got 'cube' instead"):
        comparison_sheet(meshes, plates=["cube"])
    tensors = o3d.t.geometry.TriangleMesh.from_legacy(meshes["ball"])
    with pytest.raises(MeshError, match=r"The mesh 'cube' must be .* take what its to_legacy\(\) returns"):
        comparison_sheet({**meshes, "cube": tensors})
    with pytest.raises(MeshError, match="no triangles"):
        comparison_sheet({**meshes, "nothing": type(meshes["ball"])()})
