import numpy as np
import pytest

from o3d_relief import ReliefParams, cotangent_laplacian, make_relief
from o3d_relief.bounds.lines import Lines
from o3d_relief.bounds.pairs import vertex_pairs
from o3d_relief.bounds.parts import tie_parts
from o3d_relief.stages.construction import construct
from shapes import bust, grid, joined, moved, sphere, to_mesh


def _tie(shape, index, shrink=0.3):
    vertices, faces = shape
    laplacian, _ = cotangent_laplacian(vertices, faces)
    pairs = vertex_pairs(Lines(vertices, faces))
    return laplacian, tie_parts(vertices, faces, laplacian, index, pairs, shrink * pairs.gap)


def test_one_component_has_nothing_to_tie():
    assert _tie(bust(), np.array([0]))[1] is None


def test_springs_are_symmetric_and_leave_a_common_move_alone():
    plates = [moved(grid(5, size=40), (0, 0, 10)), moved(grid(5, size=40), (0, 0, 30))]
    shape = joined(grid(11), *plates, moved(sphere(8, 5), (200, 0, 0)))
    _, ties = _tie(shape, np.array([0, 130]))  # the wall and the first plate hold points
    for form in (ties.among_held, ties.to_loose):
        assert abs(form - form.T).max() < 1e-12
        assert abs(form.sum(axis=1)).max() < 1e-12
        assert np.linalg.eigvalsh(form.toarray()).min() > -1e-9
        assert form.nnz > 0
    assert ties.among_held[146:].nnz == 0
    assert ties.to_nearest == 1


def test_empty_space_shrinks_and_the_part_follows():
    shape = joined(grid(21), moved(grid(9, size=40), (0, 0, 10)))
    corners = np.array([0, 20, 420, 440])
    laplacian, ties = _tie(shape, corners)
    built = construct(shape[0], laplacian, corners, np.zeros(4), to_loose=(ties.to_loose, ties.to_loose_pull))
    assert built.loose_components == 0
    assert built.z[:441].max() < 2.0
    gap = built.z[441:] - 0.5 * built.z[:441].max()
    assert gap == pytest.approx(3.0, abs=1.0)


def test_parts_that_touch_still_touch():
    floor = moved(grid(21), (0, 0, 5.0))
    floor[0][:, 2] += 0.2 * floor[0][:, 0]  # a slope: the post must follow it
    post = moved(grid(5, size=6), (30, 0, 11.02))
    shape = joined(floor, post)
    fixed = np.array([0, 20, 420, 440])
    laplacian, ties = _tie(shape, fixed)
    assert ties.in_contact > 0
    springs = (ties.to_loose, ties.to_loose_pull)
    built = construct(shape[0], laplacian, fixed, 0.2 * shape[0][fixed, 2], to_loose=springs)
    alone = construct(shape[0], laplacian, fixed, 0.2 * shape[0][fixed, 2])
    assert np.array_equal(built.z[:441], alone.z[:441])  # what is loose does not pull
    displacement = built.z - shape[0][:, 2]
    under = (np.abs(shape[0][:441, :2] - [30, 0]) <= 5).all(axis=1)
    assert displacement[441:].mean() == pytest.approx(displacement[:441][under].mean(), abs=0.4)


def test_part_without_a_point_does_not_keep_its_old_depth():
    head = bust()
    hat = moved(grid(7, size=20), (0, 20, 95))
    scene = to_mesh(joined(head, hat))
    params = ReliefParams(k=24)
    relief = make_relief(scene, params)
    z = relief.stages["order"].z[len(head[0]) :]
    before = relief.stages["scene"].vertices[len(head[0]) :, 2]
    assert z.max() < before.min()
    assert relief.stages["order"].counts["left"] == 0


def test_what_is_held_at_one_end_is_not_drawn_out_over_empty_space():
    held_end, board = moved(grid(3, size=4), (-18, 0, 20)), moved(grid(9, size=40), (0, 0, 20.05))
    shape = joined(grid(21), held_end, board)
    fixed = np.concatenate([[0, 20, 420, 440], np.arange(441, 450)])
    laplacian, ties = _tie(shape, fixed)
    assert ties.in_contact > 0
    assert ties.across_gaps > 0
    built = construct(
        shape[0], laplacian, fixed, shape[0][fixed, 2], to_loose=(ties.to_loose, ties.to_loose_pull)
    )
    drawn_out = np.ptp(built.z[450:])
    assert 0.5 < drawn_out < 9.0  # as stiff as between parts that hold points they draw it out by 14
