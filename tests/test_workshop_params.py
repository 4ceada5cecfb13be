import dataclasses

import pytest

from o3d_relief.errors import ParameterError
from o3d_relief.workshop_params import MillParams, TileParams


@pytest.mark.parametrize(
    ("values", "sentence"),
    [
        ({"mm_per_pixel": 0}, r"mm_per_pixel must be greater than 0\. Got 0 instead\."),
        ({"mm_per_pixel": -0.1}, r"mm_per_pixel must be greater than 0\. Got -0\.1 instead\."),
        ({"mm_per_pixel": float("nan")}, "mm_per_pixel must be finite"),
        ({"tool_mm": -3}, r"tool_mm must be at least 0\. Got -3 instead\."),
        ({"tool_mm": "3"}, "tool_mm must be a number"),
        ({"tool_mm": 0.3}, r"tool_mm must be at least two pixels \(0\.4 mm\), or 0 for no tool\. Got 0\.3"),
        ({"draft_deg": 61}, r"draft_deg must be between 0 and 60\. Got 61 instead\."),
        ({"draft_deg": -1}, "draft_deg must be between 0 and 60"),
        ({"keep_ridges": 1}, r"keep_ridges must be True or False\. Got 1 instead\."),
    ],
)
def test_mill_sizes_that_cannot_be(values, sentence):
    with pytest.raises(ParameterError, match=sentence) as caught:
        MillParams(**values)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("values", "sentence"),
    [
        ({"width_mm": 0, "height_mm": 200}, r"The tile's width_mm must be greater than 0\. Got 0"),
        ({"width_mm": 200, "height_mm": -5}, r"height_mm must be greater than 0\. Got -5 instead\."),
        ({"width_mm": float("inf"), "height_mm": 200}, "width_mm must be finite"),
        ({"width_mm": 200, "height_mm": 200, "pin_mm": 0}, "pin_mm must be greater than 0"),
        ({"width_mm": 200, "height_mm": 200, "pin_length_mm": -1}, "pin_length_mm must be greater than 0"),
        ({"width_mm": 200, "height_mm": 200, "clearance_mm": -0.1}, "clearance_mm must be between 0 and 2"),
        ({"width_mm": 200, "height_mm": 200, "clearance_mm": 3}, "clearance_mm must be between 0 and 2"),
        ({"width_mm": 200, "height_mm": 200, "number": 1}, "number must be True or False"),
        (
            {"width_mm": 200, "height_mm": 5, "pin_mm": 6},
            r"The tile's height_mm must be at least 27\.4 for pins of 6 mm that stand out 9 mm\. Got 5",
        ),
    ],
)
def test_tile_sizes_that_cannot_be(values, sentence):
    with pytest.raises(ParameterError, match=sentence) as caught:
        TileParams(**values)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("params", [MillParams(), TileParams(width_mm=1, height_mm=1)])
def test_parameters_are_frozen_numbers(params):
    name = dataclasses.fields(params)[0].name
    assert isinstance(getattr(params, name), float)
    with pytest.raises(dataclasses.FrozenInstanceError):
        setattr(params, name, 2.0)


def test_pins_are_half_as_long_again_as_thick():
    assert TileParams(width_mm=200, height_mm=200).length_of(4.0) == 6.0
    assert TileParams(width_mm=200, height_mm=200, pin_length_mm=5).length_of(4.0) == 5.0


@pytest.mark.parametrize(("base", "pin"), [(4.0, 2.0), (10.0, 5.0), (30.0, 6.0), (0.0, 3.0)])
def test_pins_are_half_as_thick_as_the_plate(base, pin):
    assert TileParams(width_mm=200, height_mm=200).pin_for(base) == pin


def test_plates_too_thin_for_a_pin_are_refused():
    tiles = TileParams(width_mm=200, height_mm=200)
    with pytest.raises(ParameterError, match=r"at least 2\.6 mm thick for pins of 1 mm\. Got 2 instead"):
        tiles.pin_for(2.0)
    with pytest.raises(ParameterError, match=r"at least 5\.6 mm thick for pins of 4 mm\. Got 4 instead"):
        TileParams(width_mm=200, height_mm=200, pin_mm=4).pin_for(4.0)
