import pytest

from o3d_relief.option_words import as_options

NAMES = ("k", "mode", "alpha", "depth", "alpha_min", "hanging", "base_mm", "max_triangles")


@pytest.mark.parametrize(
    ("sentence", "said"),
    [
        ("k must be at least 1. Got 0 instead.", "-k must be at least 1. Got 0 instead."),
        ("alpha and depth exclude each other.", "--alpha and --depth exclude each other."),
        ("alpha_min must not exceed alpha.", "--alpha-min must not exceed alpha."),
        ("The plate is too small for hanging='keyhole'.", "The plate is too small for --hanging keyhole."),
        ("2 triangles, more than 1 (max_triangles): no.", "2 triangles, more than 1 (--max-triangles): no."),
        ('mode="bounded" needs a depth.', "--mode bounded needs a depth."),
        ("The tile's base_mm is 0.", "The tile's base_mm is 0."),
        ("The relief has no depth.", "The relief has no depth."),
        ("sensor is too far.", "sensor is too far."),
        ("in/base_mm.ply and base_mm.ply: no alpha.", "in/base_mm.ply and base_mm.ply: no alpha."),
    ],
)
def test_names_become_options(sentence, said):
    assert as_options(sentence, NAMES) == said
