import pytest

from o3d_relief.params import ReliefParams
from o3d_relief.show.editor_asks import MODES, Scale, mode_of, mode_values


@pytest.mark.parametrize("first", MODES)
@pytest.mark.parametrize("second", MODES)
def test_every_mode_leads_to_every_other(first, second):
    from dataclasses import replace

    params = replace(ReliefParams(in_order=False), **mode_values(first, 4.0, 0.5))
    params = replace(params, **mode_values(second, 4.0, 0.5))
    assert mode_of(params) == second
    assert params.depth == (None if second == "alpha" else 4.0)
    assert params.alpha == (0.5 if second == "alpha" else None)


def test_alpha_of_one_is_no_compression():
    assert mode_values("alpha", 4.0, 1.0)["alpha"] is None


def test_millimetres():
    scale = Scale(unit=0.5, size_mm=200.0)  # a scene 50 long
    assert scale.to_mm(12.5) == pytest.approx(50.0)
    assert scale.to_input(50.0) == pytest.approx(12.5)
