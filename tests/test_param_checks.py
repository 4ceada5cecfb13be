import pytest

from o3d_relief.errors import ParameterError
from o3d_relief.param_checks import given
from o3d_relief.params import ReliefParams, View
from o3d_relief.scan_params import ScanParams


@pytest.mark.parametrize("kind", [ReliefParams, View, ScanParams])
def test_what_is_not_given_is_at_its_defaults(kind):
    assert given("params", None, kind) == kind()
    own = kind()
    assert given("params", own, kind) is own


@pytest.mark.parametrize("value", [{"k": 3}, ReliefParams, ScanParams(), 0, False])
def test_another_kind_is_named(value):
    with pytest.raises(ParameterError, match=r"^params must be a ReliefParams\. Got .* instead\.$"):
        given("params", value, ReliefParams)
