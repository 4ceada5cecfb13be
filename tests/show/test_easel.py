import numpy as np
import pytest

from o3d_relief.errors import ParameterError
from o3d_relief.records import ClustersStage, ConstructionStage, PerspectiveStage, SceneStage
from o3d_relief.show.easel import Easel
from shapes import grid


@pytest.fixture
def easel():
    vertices, faces = grid(3)
    scene = SceneStage(
        vertices=vertices,
        faces=faces,
        welded_index=np.arange(9),
        welded_face=np.arange(len(faces)),
        unit=1.0,
    )
    drawn = PerspectiveStage(vertices=vertices * [0.5, 0.5, 1.0] + [0.0, 0.0, 7.0])
    return Easel(stages={"scene": scene, "perspective": drawn}, size=(30, 20))


def test_a_record_is_found_by_its_kind(easel):
    assert easel.record(SceneStage) is easel.stages["scene"]


def test_a_record_that_is_missing_or_another_one_is_named(easel):
    with pytest.raises(ParameterError, match="The stage 'clusters' has no record"):
        easel.record(ClustersStage)
    wrong = Easel(stages={"construction": easel.stages["scene"]}, size=(30, 20))
    with pytest.raises(ParameterError, match="The stage 'construction' has no record"):
        wrong.record(ConstructionStage)


def test_vertices_are_those_after_the_perspective(easel):
    assert np.array_equal(easel.vertices, easel.stages["perspective"].vertices)
    assert not np.array_equal(easel.vertices, easel.stages["scene"].vertices)


def test_only_the_heights_are_other_ones(easel):
    z = np.arange(9.0)
    raised = easel.raised(z)
    assert np.array_equal(raised[:, :2], easel.vertices[:, :2])
    assert np.array_equal(raised[:, 2], z)
    assert (easel.vertices[:, 2] == 7.0).all()


def test_a_mesh_has_the_scene_s_faces_and_is_a_copy(easel):
    mesh = easel.mesh(easel.vertices)
    assert np.array_equal(np.asarray(mesh.triangles), easel.stages["scene"].faces)
    assert np.array_equal(np.asarray(mesh.vertices), easel.vertices)
    mesh.translate((0.0, 0.0, 5.0))
    assert (easel.vertices[:, 2] == 7.0).all()
