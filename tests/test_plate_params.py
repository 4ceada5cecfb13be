import pytest

from o3d_relief.errors import ParameterError
from o3d_relief.plate_params import PlateParams


def test_defaults_are_sensible():
    params = PlateParams()
    assert params.width_mm == 150.0
    assert params.edge_mm == 6.0
    assert params.back_mm == 4.0
    assert PlateParams(shape="none").back_mm == PlateParams(shape="none").edge_mm == 0.0


@pytest.mark.parametrize(
    ("values", "sentence"),
    [
        ({"width_mm": 0}, "width_mm must be greater than 0"),
        ({"depth_mm": -3}, "depth_mm must be greater than 0"),
        ({"base_mm": -1}, "base_mm must be greater than 0"),
        ({"width_mm": 1e6}, "width_mm must be at most 10000"),
        ({"width_mm": "wide"}, "width_mm must be a number"),
        ({"width_mm": float("nan")}, "width_mm must be finite"),
        ({"margin_mm": -1}, "margin_mm must be between 0 and 10000"),
        ({"frame_mm": -1}, "frame_mm must be between 0 and 10000"),
        ({"width_mm": 12}, "width_mm must be greater than twice margin_mm and frame_mm together, 12"),
        ({"base_mm": 25, "depth_mm": 25}, "base_mm must be less than depth_mm, 25"),
        ({"base_mm": 0.5}, "base_mm must be at least min_wall_mm, 0.8"),
        ({"min_wall_mm": 0.2}, "min_wall_mm must be at least nozzle_mm, 0.4: a nozzle cannot print less"),
        ({"thickness_mm": 0.2}, "thickness_mm must be at least nozzle_mm"),
        ({"embed_mm": 4}, "embed_mm must be less than base_mm, 4"),
        ({"shape": "heart"}, "shape must be one of rectangle, ellipse, contour, none"),
        ({"hanging": "nail"}, "hanging must be one of none, keyhole, magnets"),
        (
            {"frame_mm": 12, "depth_mm": 15},
            "base_mm and frame_height_mm together, 16, must not",
        ),
        ({"thicken": 1}, "thicken must be True or False"),
        ({"loose": "glue"}, "loose must be one of report, bridge, remove"),
        ({"print_direction": "up"}, "print_direction must be one of x, y, z"),
        ({"overhang_degrees": 100}, "overhang_degrees must be between 0 and 90"),
        ({"hanging": "keyhole"}, "base_mm must be at least 4.6 for hanging='keyhole'"),
        ({"hanging": "magnets", "magnet_height_mm": 5}, "base_mm must be at least 6 for hanging='magnets'"),
        ({"hanging": "magnets", "shape": "none"}, "needs a plate"),
    ],
)
def test_wrong_sizes_are_one_sentence_each(values, sentence):
    with pytest.raises(ParameterError, match=sentence.replace("'", ".")) as caught:
        PlateParams(**values)
    assert "\n" not in str(caught.value)
