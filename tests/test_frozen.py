import copy
import pickle
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import pytest

from o3d_relief.frozen import Frozen


@dataclass(frozen=True, kw_only=True, eq=False)
class Counted(Frozen):
    counts: Mapping[str, int]


@dataclass(frozen=True, kw_only=True, eq=False)
class Weighted(Counted):
    values: np.ndarray
    name: str = "weights"


def test_arrays_and_mappings_are_read_only_and_their_sources_are_not():
    values, counts = np.ones(3), {"a": 1}
    record = Weighted(counts=counts, values=values)
    with pytest.raises(ValueError, match="read-only"):
        record.values[0] = 2.0
    with pytest.raises(TypeError):
        record.counts["a"] = 2
    values[0], counts["a"] = 5.0, 7
    assert record.values[0] == 5.0  # a view, not a copy
    assert record.counts == {"a": 1}


@pytest.mark.parametrize("through", [lambda r: pickle.loads(pickle.dumps(r)), copy.copy, copy.deepcopy])
def test_what_is_pickled_or_copied_is_read_only_again(through):
    record = Weighted(counts={"a": 1}, values=np.arange(3), name="other")
    again = through(record)
    assert type(again) is Weighted
    assert (again.name, again.counts, again.values.tolist()) == ("other", {"a": 1}, [0, 1, 2])
    assert not again.values.flags.writeable
    with pytest.raises(TypeError):
        again.counts["b"] = 1
