import numpy as np
import pytest

from o3d_relief import ParameterError, PointEdit, ReliefParams, make_relief
from shapes import bust, hills, to_mesh


def _points(mesh, **values):
    return make_relief(mesh, ReliefParams.paper(k=16, **values)).stages["attenuation"]


@pytest.fixture(scope="module")
def mesh():
    return to_mesh(hills(31))


@pytest.fixture(scope="module")
def plain(mesh):
    return _points(mesh)


def test_edits_of_single_points(mesh, plain):
    point = int(np.flatnonzero(plain.action == "scale")[0])
    vertex = int(plain.index[point])  # nothing is welded here
    attached = _points(mesh, point_edits=[PointEdit(vertex=vertex, action="attach")])
    assert attached.action[point] == "attach"
    assert (np.delete(attached.action, point) == np.delete(plain.action, point)).all()
    assert attached.new_height[point] < plain.new_height[point]
    discarded = _points(mesh, point_edits=[PointEdit(vertex=vertex, action="discard")])
    assert np.isnan(discarded.new_height[point])
    assert len(discarded.kept_index) == len(plain.kept_index) - 1
    stood_out = _points(mesh, point_edits=[PointEdit(vertex=vertex, beta=0.01)])
    assert stood_out.beta[point] == 0.01
    assert (stood_out.action == plain.action).all()
    assert stood_out.new_height[point] != plain.new_height[point]


def test_an_edit_equals_a_sequence_of_betas(mesh, plain):
    beta = np.full(16, 0.2)
    beta[3] = 0.7
    edited = _points(mesh, point_edits=[PointEdit(vertex=int(plain.index[3]), beta=0.7)])
    assert (edited.new_height == _points(mesh, beta=beta).new_height)[edited.action != "discard"].all()


def test_any_vertex_of_the_cluster_names_its_point(mesh, plain):
    labels = make_relief(mesh, ReliefParams.paper(k=16)).stages["clusters"].labels
    for vertex in np.flatnonzero(labels == plain.cluster[5])[:3]:
        edited = _points(mesh, point_edits=[PointEdit(vertex=int(vertex), action="discard")])
        assert edited.action[5] == "discard"


def test_the_later_edit_counts(mesh, plain):
    vertex = int(plain.index[2])
    edits = [
        PointEdit(vertex=vertex, action="discard", beta=0.5),
        PointEdit(vertex=vertex, action="attach"),
    ]
    points = _points(mesh, point_edits=edits)
    assert points.action[2] == "attach"
    assert points.beta[2] == 0.5
    assert points.counts["edits"] == 2


def test_a_released_point_is_attached_last(mesh, plain):
    lowest = int(plain.rho.argmin())
    points = _points(mesh, point_edits=[PointEdit(vertex=int(plain.index[lowest]), action="scale")])
    assert points.action[lowest] == "scale"
    # Where all are released, each group of neighbours still needs one on the plane.
    edits = [PointEdit(vertex=int(vertex), action="scale") for vertex in plain.index]
    points = _points(mesh, point_edits=edits)
    assert (points.action == "attach").sum() == points.counts["groups_attached"] > 0


def test_edits_that_concern_nothing(mesh):
    with pytest.raises(ParameterError, match="must be one of the mesh's 961"):
        _points(mesh, point_edits=[PointEdit(vertex=961, beta=1)])
    with pytest.raises(ParameterError, match="leave at least one"):
        _points(mesh, point_edits=[PointEdit(vertex=v, action="discard") for v in range(961)])
    vertices, faces = hills(31)
    stray = to_mesh((np.concatenate([vertices, [[0, 0, 0]]]), faces))
    with pytest.raises(ParameterError, match="must belong to a triangle"):
        _points(stray, point_edits=[PointEdit(vertex=961, beta=1)])


def test_an_edit_of_a_cluster_without_a_point_is_counted():
    mesh = to_mesh(bust(30))
    relief = make_relief(mesh, ReliefParams.paper(k=300))
    stages = relief.stages
    hidden = np.setdiff1d(np.arange(300), stages["attenuation"].cluster)
    assert len(hidden) > 0
    welded = np.flatnonzero(stages["clusters"].labels == hidden[0])[0]
    vertex = int(np.flatnonzero(stages["scene"].welded_index == welded)[0])
    edited = make_relief(mesh, ReliefParams.paper(k=300, point_edits=[PointEdit(vertex=vertex, beta=1)]))
    assert edited.stages["attenuation"].counts["edits_without_point"] == 1
    assert (edited.stages["compression"].z == stages["compression"].z).all()
