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
        ("depth.ply is not written.", "depth.ply is not written."),
        ("alpha and depth.ply.", "--alpha and depth.ply."),
        ("C:\\scans\\base_mm\\x.ply is empty.", "C:\\scans\\base_mm\\x.ply is empty."),
    ],
)
def test_names_become_options(sentence, said):
    assert as_options(sentence, NAMES) == said


@pytest.mark.parametrize(
    ("sentence", "said"),
    [
        ("/d/my base_mm scans/x.ply: base_mm is 0", "/d/my base_mm scans/x.ply: --base-mm is 0"),
        ("depth-1.ply, depth of alpha_min", "depth-1.ply, depth of --alpha-min"),
        ("alpha and depth exclude each other.", "--alpha and --depth exclude each other."),
        ("No base_mm: 1-depth-1.ply5", "No --base-mm: 1-depth-1.ply5"),
    ],
)
def test_names_of_files_are_kept(sentence, said):
    assert as_options(sentence, NAMES, ["my", "/d/my base_mm scans/x.ply", "depth-1.ply"]) == said
