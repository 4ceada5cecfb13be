import sys

import pytest

from o3d_relief.batch_engine import open_engine
from o3d_relief.errors import ParameterError, ReliefError


@pytest.mark.parametrize(
    ("engine", "address", "sentence"),
    [
        ("slurm", None, "must be one of loky, dask, ray"),
        ("loky", "tcp://a:1", "needs engine dask or ray"),
    ],
)
def test_wrong_engines(engine, address, sentence):
    with pytest.raises(ParameterError, match=sentence), open_engine(engine, address, 2):
        pass


@pytest.mark.parametrize(("engine", "module"), [("dask", "distributed"), ("ray", "ray")])
def test_an_engine_that_is_not_installed(monkeypatch, engine, module):
    monkeypatch.setitem(sys.modules, module, None)
    sentence = rf"is not installed: pip install 'o3d-relief\[{engine}\]'"
    with pytest.raises(ReliefError, match=sentence), open_engine(engine, None, 2):
        pass
