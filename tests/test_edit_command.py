"""What the editor's command says when its window is closed."""

import pytest

import o3d_relief as rel
from o3d_relief.edit_command import _words

EDITS = (rel.PointEdit(vertex=3, action="attach"),)


@pytest.mark.parametrize(
    ("params", "view", "words"),
    [
        (rel.ReliefParams(depth=3.5), rel.View(), "the closest relief of depth 3.5"),
        (
            rel.ReliefParams(k=9, alpha=0.8, point_edits=EDITS),
            rel.View(),
            "k 9, beta 0.2, alpha 0.8, 1 point edited by hand",
        ),
        (
            rel.ReliefParams(depth=2, mode="attenuation"),
            rel.View(vanishing_point=(0, 0, -300)),
            "k 128, beta 0.2, depth 2, 0 points edited by hand, vanishing point (0.0, 0.0, -300.0)",
        ),
    ],
)
def test_closing_names_what_counts(params, view, words):
    assert _words(params, view) == words
