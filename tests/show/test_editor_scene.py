import numpy as np

from o3d_relief.editor import EditorPoints
from o3d_relief.show.editor_scene import nearest_point, points_within

UNIT = 0.5
NEW = np.array([[0, 0, 1], [10, 0, 2], [10, 5, 30], [-20, 0, 4.0]])
POINTS = EditorPoints(
    vertex=np.arange(4),
    position=UNIT * (NEW + np.array([0, 0, 50])),
    new_position=UNIT * NEW,
    action=np.array(["attach", "scale", "scale", "discard"]),
    beta=np.full(4, 0.2),
    edited=np.zeros(4, dtype=bool),
)
NONE = EditorPoints(
    vertex=np.zeros(0, dtype=np.int64),
    position=np.zeros((0, 3)),
    new_position=np.zeros((0, 3)),
    action=np.zeros(0, dtype="U7"),
    beta=np.zeros(0),
    edited=np.zeros(0, dtype=bool),
)


def test_the_nearest_point_goes_by_what_is_seen_from_the_front():
    assert nearest_point(np.array([9.0, 1.0, 90.0]), POINTS, UNIT) == 1
    assert nearest_point(np.array([9.0, 4.0, 3.0]), POINTS, UNIT) == 2
    assert nearest_point(np.zeros(3), NONE, UNIT) is None


def test_the_brush_goes_by_what_is_seen_from_the_front():
    assert points_within(np.array([9.0, 2.0, 0.0]), POINTS, UNIT, 4.0) == [1, 2]
    assert points_within(np.array([9.0, 2.0, 0.0]), POINTS, UNIT, 40.0) == [0, 1, 2, 3]
    assert points_within(np.zeros(3), NONE, UNIT, 40.0) == []
