from functools import partial

import numpy as np
import pytest

from o3d_relief.bounds.crossings import crossings, edges_of
from o3d_relief.bounds.grid import grid_pairs
from o3d_relief.bounds.lines import Lines
from o3d_relief.bounds.origin import Origin
from o3d_relief.bounds.pairs import vertex_pairs
from o3d_relief.bounds.places import Place, crossing_places, few, gap_places, pair_places, told
from shapes import grid, joined, moved

_GRID = partial(grid_pairs, side=64)


def _place(x, reason="", kind="inversion"):
    return Place(kind=kind, x=x, y=0.0, lower=1.0, upper=2.0, reason=reason)


def _gaps(scene, faces, relief, min_gap, make=_GRID):
    pairs = make(Lines(relief, faces))
    origin = Origin(faces, faces, scene)
    some = pairs.select(few(np.flatnonzero(pairs.gap < min_gap)))
    return gap_places(relief, scene[:, 2], some, pairs, origin, min_gap=min_gap)


def test_few_are_spread_over_all():
    assert few(np.arange(10)).tolist() == list(range(10))
    chosen = few(np.arange(1000))
    assert len(chosen) == 10
    assert (chosen[0], chosen[-1]) == (0, 999)


def test_sentences_name_each_reason_once_and_three_places():
    places = [_place(1.0, "why"), _place(9.0, kind="other"), _place(2.0), _place(3.0, "why"), _place(4.0)]
    assert told(places, "inversion") == "for instance at (1.0, 0.0), (3.0, 0.0): why; at (2.0, 0.0)"


def test_gaps_known_from_both_of_their_ends_count_once():
    scene, faces = joined(grid(11), moved(grid(11), (0, 0, 10)), moved(grid(11), (0, 0, 20)))
    relief = scene * [1, 1, 0.5]
    for make in (_GRID, vertex_pairs):
        places = _gaps(scene, faces, relief, 5.5, make)
        assert len(places) == 10
        for place in places:
            assert place.upper - place.lower == pytest.approx(5.0)
        counts = {place.reason.split(" = ")[0].rsplit(", ")[-1] for place in places}
        if make is _GRID:
            assert counts == {"2 x 5.5"}
        else:
            assert counts <= {
                "2 x 5.5",
                "if all depths shrank alike to the relief's",
                "5 would be left of the 5.5 asked for",
            }


def test_reasons_for_gaps_in_a_deep_relief():
    # One sheet that is folded along x = 0, and a far plate that makes the relief deep.
    fold = np.array([[0, -10, 20], [0, 10, 20], [30, -10, 35], [30, 10, 35], [30, -10, 5], [30, 10, 5.0]])
    folded = fold, np.array([[0, 2, 1], [1, 2, 3], [0, 1, 4], [1, 5, 4]])
    scene, faces = joined(grid(11), moved(folded, (0, 0, 40)))
    places = _gaps(scene, faces, scene, 3.0)
    assert {place.reason for place in places} == {"their surfaces are one sheet and meet right beside"}
    scene, faces = joined(grid(11), moved(grid(3, size=9), (0, 0, 4)), moved(grid(3, size=9), (30, 0, 90)))
    (reason,) = {place.reason for place in _gaps(scene, faces, scene * [1, 1, 0.5], 3.0)}
    assert (
        reason
        == "if all depths shrank alike to the relief's, 2 would be left of the 3 asked for (relief units)"
    )
    squeezed = np.where(scene[:, 2:] < 50, scene * [1, 1, 0.5], scene)
    assert {place.reason for place in _gaps(scene, faces, squeezed, 3.0)} == {""}


def test_inverted_plates_have_no_reason_and_both_heights():
    scene, faces = joined(grid(11), moved(grid(5, size=40), (0, 0, 10)))
    relief = np.where(scene[:, 2:] > 5, scene - [0, 0, 13], scene)
    pairs = _GRID(Lines(relief, faces))
    places = pair_places(
        "inversion", relief, pairs.select(few(np.arange(len(pairs)))), Origin(faces, faces, scene)
    )
    for place in places:
        assert (place.lower, place.upper) == pytest.approx((-3.0, 0.0))
        assert place.reason == ""


def test_crossings_say_what_was_there_before():
    needle = np.array([[-3.0, 21.0, -1], [5.0, 22.0, 1], [5.0, 29.0, 1]]), np.array([[0, 1, 2]])
    relief, faces = joined(grid(2), needle)
    met = crossings(relief, faces, edges_of(faces))
    for lift, reason in ((3.0, ""), (1.0, "they touched in the scene")):
        scene = relief + np.where(np.arange(7) < 4, 0.0, lift)[:, None] * [0, 0, 1]
        places = crossing_places(
            relief, scene[:, 2], met, np.zeros(2, dtype=bool), Origin(faces, faces, scene)
        )
        assert [(place.kind, place.reason) for place in places] == [("new crossing", reason)] * 2
        for place in places:
            assert place.x == pytest.approx(1.0)
            assert place.upper == pytest.approx(0.0)
    places = crossing_places(relief, scene[:, 2], met, np.array([True, False]), Origin(faces, faces, scene))
    assert [place.kind for place in places] == ["new crossing", "old crossing"]
