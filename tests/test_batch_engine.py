import sys

import pytest

from o3d_relief.batch_engine import check_engine, open_engine
from o3d_relief.errors import ParameterError, ReliefError


@pytest.mark.parametrize(
    ("engine", "address", "jobs", "sentence"),
    [
        ("slurm", None, 2, "must be one of loky, dask, ray"),
        ("loky", "tcp://a:1", None, "needs engine dask or ray"),
        ("dask", "tcp://a:1", 0, "jobs must be a whole number, at least 1"),
    ],
)
def test_wrong_engines(engine, address, jobs, sentence):
    with pytest.raises(ParameterError, match=sentence):
        check_engine(engine, address, jobs)


@pytest.mark.parametrize(("engine", "module"), [("dask", "distributed"), ("ray", "ray")])
def test_an_engine_that_is_not_installed(monkeypatch, engine, module):
    monkeypatch.setitem(sys.modules, module, None)
    sentence = rf"is not installed: pip install 'o3d-relief\[{engine}\]'"
    with pytest.raises(ReliefError, match=sentence), open_engine(engine, None, 2):
        pass


@pytest.mark.parametrize("address", ["127.0.0.1:9", "ray://127.0.0.1:9"])
def test_a_ray_cluster_that_is_not_there(address):
    pytest.importorskip("ray")
    with pytest.raises(ReliefError, match="does not answer"), open_engine("ray", address, None):
        pass


def test_a_cluster_without_workers_or_patience(monkeypatch):
    distributed = pytest.importorskip("distributed")
    monkeypatch.setattr("o3d_relief.batch_engine._PATIENCE", 0.5)
    nobody = {"n_workers": 0, "dashboard_address": None, "processes": False}
    with distributed.LocalCluster(**nobody) as cluster:
        address = cluster.scheduler_address
        with pytest.raises(ReliefError, match="has no workers"), open_engine("dask", address, None):
            pass
        cluster.scale(1)
        cluster.scheduler.allowed_failures = 1
        monkeypatch.setattr("o3d_relief.batch_engine._PATIENCE", 30)
        sentence = "gives a task up after 1 lost workers, too early to tell"
        with pytest.raises(ReliefError, match=sentence), open_engine("dask", address, None):
            pass


def test_a_cluster_that_is_not_there():
    pytest.importorskip("distributed")  # has to be there before its settings are changed
    dask = pytest.importorskip("dask")
    with (
        dask.config.set({"distributed.comm.timeouts.connect": "0.2s"}),
        pytest.raises(ReliefError, match="does not answer, or has no workers"),
        open_engine("dask", "tcp://127.0.0.1:9", None),
    ):
        pass
