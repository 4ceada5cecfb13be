from dataclasses import replace

import numpy as np
import pytest

from o3d_relief.errors import ParameterError
from o3d_relief.solid.heights import height_field
from o3d_relief.solid.milling import ball_closing, ball_opening, draft, milled
from o3d_relief.workshop_params import MillParams
from slabs import ball_on_slab, slab


def rough(rows=40, columns=50, seed=0):
    """Heights with steps, needles and holes, and a piece missing."""
    rng = np.random.default_rng(seed)
    z = rng.normal(scale=2.0, size=(rows, columns)).cumsum(axis=0).cumsum(axis=1) * 0.05
    z[10:20, 10:30] += 8.0
    z[rows // 2, columns // 2] += 10.0
    z[-10, 5] -= 10.0
    z[-6:, -9:] = np.nan
    return z


def literal_closing(z, radius, pixel):
    """The ball at every place, also beside the piece, as deep as it goes; what it leaves standing."""
    wide = int(radius / pixel + 1e-9)
    rows, columns = z.shape
    cells = [
        (i, j, np.sqrt(max(radius**2 - (i * i + j * j) * pixel**2, 0.0)))
        for i in range(-wide, wide + 1)
        for j in range(-wide, wide + 1)
        if (i * i + j * j) * pixel**2 <= radius**2 * (1 + 1e-9)
    ]
    left = np.full(z.shape, np.inf)
    for y in range(-wide, rows + wide):
        for x in range(-wide, columns + wide):
            under = [
                (y + i, x + j, depth) for i, j, depth in cells if 0 <= y + i < rows and 0 <= x + j < columns
            ]
            touched = [z[i, j] + depth for i, j, depth in under if not np.isnan(z[i, j])]
            center = max(touched) if touched else -np.inf
            for i, j, depth in under:
                left[i, j] = min(left[i, j], center - depth)
    return np.where(np.isnan(z), np.nan, left)


@pytest.mark.parametrize(("radius", "pixel"), [(1.0, 0.5), (2.1, 0.7), (0.5, 0.5)])
def test_closing_is_what_a_rolling_ball_leaves(radius, pixel):
    z = rough(18, 22)
    np.testing.assert_allclose(ball_closing(z, radius, pixel), literal_closing(z, radius, pixel), atol=1e-12)


def test_closing_only_fills_and_opening_only_takes_away():
    z = rough()
    inside = np.isfinite(z)
    assert (ball_closing(z, 1.5, 0.5) >= z)[inside].all()
    assert (ball_opening(z, 1.5, 0.5) <= z)[inside].all()
    assert np.array_equal(np.isfinite(ball_closing(z, 1.5, 0.5)), inside)


@pytest.mark.parametrize("filtered", [ball_closing, ball_opening])
def test_doing_it_again_changes_nothing(filtered):
    once = filtered(rough(), 1.5, 0.5)
    np.testing.assert_allclose(filtered(once, 1.5, 0.5), once, atol=1e-12)


def test_a_bowl_of_the_tools_own_radius_is_kept_and_a_narrower_one_is_not():
    x = (np.arange(41) - 20) * 0.25
    squared = x**2 + x[:, None] ** 2

    def bowl(radius):
        return -np.sqrt(np.maximum(radius**2 - squared, 0.0))

    np.testing.assert_allclose(ball_closing(bowl(4.0), 4.0, 0.25), bowl(4.0), atol=1e-9)
    filled = ball_closing(bowl(2.0), 4.0, 0.25)
    # The ball rests on the rim of the hole, which lies on the grid: sqrt(4^2 - 2^2) above its lowest point.
    assert filled[20, 20] == pytest.approx(np.sqrt(12.0) - 4.0, abs=1e-9)


def test_draft_makes_the_slope_of_a_step():
    z = np.zeros((5, 60))
    z[:, :10] = 4.0
    made = draft(z, 20.0, 0.1)
    distance = np.maximum(np.arange(60) - 9, 0) * 0.1
    wanted = np.maximum(4.0 - distance / np.tan(np.radians(20.0)), 0.0)
    np.testing.assert_allclose(made, np.tile(wanted, (5, 1)), atol=1e-9)


@pytest.mark.parametrize("angle", [3.0, 30.0, 60.0])
def test_no_wall_is_steeper_than_the_draft(angle):
    z, pixel = rough(), 0.5
    made = draft(z, angle, pixel)
    steepest = pixel / np.tan(np.radians(angle)) + 1e-9
    for first, second, length in (
        (made[1:], made[:-1], 1.0),
        (made[:, 1:], made[:, :-1], 1.0),
        (made[1:, 1:], made[:-1, :-1], np.sqrt(2.0)),
        (made[3:, 2:], made[:-3, :-2], np.sqrt(13.0)),
    ):
        assert np.nanmax(np.abs(first - second)) <= steepest * length
    assert (made >= z)[np.isfinite(z)].all()
    assert np.nanmax(made) == np.nanmax(z)


def test_draft_of_a_far_slope_is_that_of_a_cone():
    z = np.zeros((101, 101))
    z[50, 50] = 20.0
    made = draft(z, 45.0, 0.5)  # forty pixels: five times the cone that is used
    x = (np.arange(101) - 50) * 0.5
    wanted = np.maximum(20.0 - np.hypot(x, x[:, None]), 0.0)
    assert (made <= wanted + 1e-9).all()
    assert np.abs(made - wanted).max() < 0.01 * 20.0


def test_flat_pieces_stay_as_they_are():
    z = np.full((12, 15), 2.5)
    for made in (draft(z, 10.0, 0.5), ball_closing(z, 2.0, 0.5), ball_opening(z, 2.0, 0.5)):
        np.testing.assert_allclose(made, z, atol=1e-12)


def test_milled_fields_have_nothing_that_the_tool_cannot_reach():
    field = height_field(ball_on_slab(), 0.5)
    params = MillParams(mm_per_pixel=0.5, tool_mm=4.0, draft_deg=10.0)
    made = milled(field, params)
    np.testing.assert_allclose(ball_closing(made.z, 2.0, 0.5), made.z, atol=1e-12)
    steps = np.abs(np.diff(made.z, axis=1)).max()
    assert steps <= 0.5 / np.tan(np.radians(10.0)) + 1e-9
    assert np.nanmax(made.z) == pytest.approx(field.highest, abs=1e-12)


def test_a_blunted_tip_does_not_cost_depth():
    field = height_field(slab(), 0.5)
    x = (np.arange(120) - 60) * 0.5
    cone = np.maximum(10.0 - 2.0 * np.hypot(x, x[20:100, None]), 0.0)
    tip = replace(field.with_heights(cone), highest=10.0)
    tool = MillParams(mm_per_pixel=0.5, tool_mm=1.0)
    assert ball_opening(cone, 0.5, 0.5).max() < 9.6
    made = milled(tip, tool).z
    assert made.max() == pytest.approx(10.0, abs=1e-12)
    assert (made[np.hypot(x, x[20:100, None]) > 6.0] == 0.0).all()


def test_a_tip_that_is_lost_is_not_made_up_for():
    field = height_field(slab(), 0.5)
    needle = np.zeros((80, 120))
    needle[40, 60] = 10.0
    needle[10:30, 10:30] = 2.0
    made = milled(
        replace(field.with_heights(needle), highest=10.0), MillParams(mm_per_pixel=0.5, tool_mm=2.0)
    )
    assert made.z.max() == pytest.approx(2.0, abs=1e-9)


@pytest.mark.parametrize(("highest", "wanted"), [(2.19, 2.19), (2.21, 2.0), (1.9, 2.0)])
def test_depth_is_made_up_for_by_a_tenth_at_most(highest, wanted):
    field = height_field(slab(), 0.5)
    z = np.full((80, 120), -1.0)
    z[40, 60], z[20, 20] = 2.0, 1.0
    made = milled(replace(field.with_heights(z), highest=highest), MillParams(mm_per_pixel=0.5)).z
    np.testing.assert_allclose(made, np.where(z > 0.0, z * wanted / 2.0, z), atol=1e-12)


def test_ridges_are_kept_on_request():
    field = height_field(slab(), 0.5)
    z = np.array(field.z)
    z[:, 60] = 5.0
    ridge = replace(field.with_heights(z), highest=5.0)
    tool = {"mm_per_pixel": 0.5, "tool_mm": 4.0}
    assert milled(ridge, MillParams(**tool)).z.max() < 0.5
    assert (milled(ridge, MillParams(**tool, keep_ridges=True)).z[:, 60] == 5.0).all()


def test_no_tool_and_no_draft_only_mend_the_height_of_the_highest_pixel():
    field = height_field(ball_on_slab(), 0.5)
    assert field.highest > np.nanmax(field.z)
    np.testing.assert_allclose(milled(field, MillParams(mm_per_pixel=0.5)).z, field.z, atol=0.05)
    assert np.nanmax(milled(field, MillParams(mm_per_pixel=0.5)).z) == pytest.approx(field.highest)


def test_a_tool_larger_than_the_piece_is_refused():
    field = height_field(slab(), 0.5)
    with pytest.raises(ParameterError, match=r"smaller than the piece, 60 x 40 mm\. Got 41"):
        milled(field, MillParams(mm_per_pixel=0.5, tool_mm=41.0))
