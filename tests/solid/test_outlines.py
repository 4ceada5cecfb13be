import numpy as np
from solid_bodies import sheet

from o3d_relief.solid.outlines import once_covered


def test_a_closed_part_and_a_sheet_stay():
    vertices, faces = sheet(lambda x, y: 5 + np.sin(x))
    assert len(once_covered(vertices, faces)) == len(faces)


def test_where_two_sheets_overlap_the_lower_goes():
    low, high = sheet(lambda x, y: 2 + 0 * x), sheet(lambda x, y: 8 + 0.1 * x)
    vertices = np.concatenate([low[0], high[0] + [39.5, 0.3, 0.0]])
    faces = np.concatenate([low[1], high[1] + len(low[0])])
    stays = once_covered(vertices, faces)
    assert set(range(len(low[1]), len(faces))) <= set(stays.tolist())
    lower = stays[stays < len(low[1])]
    # Of the last column of the lower sheet nothing is left below the upper one.
    below = (vertices[faces[lower], 0] > 19.5).sum(axis=1) * (vertices[faces[lower], 1] > -19.7).all(axis=1)
    assert below.max() == 0
    assert len(lower) >= len(low[1]) - 22


def test_a_back_without_a_front_goes():
    vertices, faces = sheet(lambda x, y: 5 + 0 * x)
    assert len(once_covered(vertices, faces[:, ::-1])) < len(faces)
