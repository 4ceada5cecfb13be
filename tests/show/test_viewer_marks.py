import numpy as np

from o3d_relief.records import AttenuationStage
from o3d_relief.show.scene_panels import ACTIONS
from o3d_relief.show.viewer_marks import Caption, plane_outline, point_balls, point_lines, wireframe
from shapes import bust

SURFACE = np.array([[0, 0, 5], [10, 0, 6], [20, 0, 7], [30, 0, 8.0]])
POINTS = AttenuationStage(
    index=np.array([1, 2, 3]),
    cluster=np.array([0, 1, 2]),
    height=np.array([6.0, 7.0, 8.0]),
    differential=np.zeros(3),
    rho=np.zeros(3),
    beta=np.zeros(3),
    action=np.array(["attach", "discard", "scale"]),
    new_height=np.array([0.0, np.nan, 4.0]),
)


def test_a_ball_lies_at_each_point_in_the_colour_of_its_action():
    mesh = point_balls(POINTS, SURFACE)
    balls = np.asarray(mesh.vertices).reshape(3, -1, 3)
    np.testing.assert_allclose(balls.mean(axis=1), SURFACE[1:], atol=1e-9)
    colors = np.asarray(mesh.vertex_colors).reshape(3, -1, 3)
    np.testing.assert_array_equal(colors[:, 0], [ACTIONS[name] for name in POINTS.action])


def test_lines_go_from_the_old_to_the_new_place():
    lines = point_lines(POINTS, SURFACE)
    ends = np.asarray(lines.points)[np.asarray(lines.lines)]
    np.testing.assert_array_equal(ends, [[[10, 0, 6], [10, 0, 0]], [[30, 0, 8], [30, 0, 4]]])
    np.testing.assert_array_equal(np.asarray(lines.colors), [ACTIONS["attach"], ACTIONS["scale"]])


def test_wireframe_has_every_edge_once():
    vertices, faces = bust(12)
    lines = wireframe(vertices, faces)
    assert len(lines.lines) == 1.5 * len(faces)  # a closed surface


def test_wireframe_of_many_edges_is_coarse_and_in_the_same_place():
    vertices, faces = bust(150)
    lines = wireframe(vertices, faces)
    assert len(lines.lines) < 30_000
    points = np.asarray(lines.points)
    np.testing.assert_allclose(points.min(axis=0), vertices.min(axis=0), atol=3.0)
    np.testing.assert_allclose(points.max(axis=0), vertices.max(axis=0), atol=3.0)


def test_plane_outline_is_flat():
    lines = plane_outline(np.array([[-10, -20, 3], [10, 20, 9.0]]))
    points = np.asarray(lines.points)
    assert not points[:, 2].any()
    np.testing.assert_array_equal(points.min(axis=0), [-13, -23, 0])


def test_caption_writes():
    caption = Caption(np.array([[-50, -40, 0], [50, 40, 30.0]]))
    blank = np.array(caption.mesh.textures[0])
    caption.say("3/10 visibility", (((1.0, 0.0, 0.0), "red"),))
    written = np.array(caption.mesh.textures[0])
    assert blank.std() == 0.0
    assert 0.002 < (written != blank).any(axis=2).mean() < 0.2
    red = (written[..., 0] > 150) & (written[..., 1:] < 30).all(axis=2)
    assert red.sum() > 1000
    assert np.asarray(caption.mesh.vertices)[:, 1].max() < -40  # under the scene
