import numpy as np
import open3d as o3d
import pytest

import o3d_relief as rel
from o3d_relief.progress import Progress, share_of_way
from shapes import bust, hills, joined, moved, sphere, to_mesh


class Watcher:
    """Keeps what it is told and answers False from a stage on."""

    def __init__(self, stop_in=None, after=0):
        self.told = []
        self.stop_in, self.after = stop_in, after

    def __call__(self, stage, share):
        self.told.append((stage, share))
        count = sum(name == self.stop_in for name, _ in self.told)
        return False if stage == self.stop_in and count > self.after else None

    def stages(self):
        return list(dict.fromkeys(stage for stage, _ in self.told))

    def shares(self, stage):
        return [share for name, share in self.told if name == stage]


def stacked():
    """Two bodies, one before the other, that the paper's method pushes through each other."""
    return to_mesh(joined(bust(14), moved(sphere(10, 30.0), (5.0, 0.0, 70.0))))


@pytest.mark.parametrize(("depth", "long"), [(None, "order"), (20.0, "bounded")])
def test_every_stage_is_told_from_its_beginning_to_its_end(depth, long):
    watcher = Watcher()
    mesh = stacked() if depth is None else to_mesh(bust(10))
    relief = rel.make_relief(mesh, rel.ReliefParams(k=8, depth=depth), on_progress=watcher)
    assert watcher.stages() == list(relief.stages)
    for stage in relief.stages:
        shares = watcher.shares(stage)
        assert shares[0] is None
        assert shares[-1] == 1.0
        assert shares.count(1.0) == 1
        known = [share for share in shares if share is not None]
        assert known == sorted(known)
        assert all(0.0 <= share <= 1.0 for share in known)
    assert any(share is not None and 0.0 < share < 1.0 for share in watcher.shares(long))
    if depth is not None:
        # What comes before the rounds takes long on large meshes.
        assert watcher.shares("bounded")[1:4] == [0.0, 0.1, 0.2]


def test_each_step_of_the_linear_solver_is_a_chance_to_stop():
    mesh = to_mesh(hills(80))  # above the size up to which it is solved directly
    watcher = Watcher()
    rel.make_relief(mesh, rel.ReliefParams(k=8, in_order=False), on_progress=watcher)
    assert len(watcher.shares("construction")) > 5
    stopped = Watcher(stop_in="construction", after=3)
    with pytest.raises(rel.Cancelled, match="in the stage construction"):
        rel.make_relief(mesh, rel.ReliefParams(k=8, in_order=False), on_progress=stopped)
    assert len(stopped.shares("construction")) == 4


@pytest.mark.parametrize("answer", [False, np.False_])
def test_false_of_numpy_is_false(answer):
    with pytest.raises(rel.Cancelled):
        Progress(lambda _stage, _share: answer).begin("order")


@pytest.mark.parametrize("answer", [None, 0, 0.0, "", np.int64(0), True, np.True_])
def test_any_other_answer_lets_the_work_go_on(answer):
    Progress(lambda _stage, _share: answer).begin("order")


@pytest.mark.parametrize("depth", [None, 20.0])
def test_it_can_be_called_off_in_every_stage(depth):
    params = rel.ReliefParams(k=8, depth=depth)
    mesh = to_mesh(bust(12))
    before = np.asarray(mesh.vertices).copy()
    for name in rel.make_relief(mesh, params).stages:
        kept, watcher = [], Watcher(stop_in=name)
        with pytest.raises(rel.Cancelled, match=rf"called off, in the stage {name}\."):
            rel.make_relief(mesh, params, on_stage=lambda s: kept.append(s.name), on_progress=watcher)  # noqa: B023
        assert watcher.stages()[-1] == name
        assert name not in kept
    assert (np.asarray(mesh.vertices) == before).all()


def test_an_error_of_the_caller_comes_back_as_it_is():
    def on_progress(stage, _share):
        raise KeyError(stage)

    with pytest.raises(KeyError, match="scene"):
        rel.make_relief(to_mesh(bust(12)), rel.ReliefParams(k=4), on_progress=on_progress)


def test_watching_changes_nothing():
    mesh, params = to_mesh(bust(12)), rel.ReliefParams(k=8)
    alone, watched = rel.make_relief(mesh, params), rel.make_relief(mesh, params, on_progress=Watcher())
    assert np.asarray(alone.mesh.vertices).tobytes() == np.asarray(watched.mesh.vertices).tobytes()


def test_a_scan_comes_first():
    cloud = o3d.geometry.PointCloud(o3d.utility.Vector3dVector(hills(60)[0]))
    watcher = Watcher()
    relief = rel.make_relief(cloud, rel.ReliefParams(k=8, in_order=False), on_progress=watcher)
    assert watcher.stages() == list(relief.stages)
    assert watcher.stages()[0] == "points"
    assert len(watcher.shares("orientation")) > 20  # one for each direction from which the points are seen
    with pytest.raises(rel.Cancelled, match="in the stage surface"):
        rel.scan_points(cloud, on_progress=Watcher(stop_in="surface"))


def test_cancelled_is_an_error_of_this_package():
    assert issubclass(rel.Cancelled, rel.ReliefError)


def test_what_was_told_is_not_taken_back():
    watcher = Watcher()
    progress = Progress(watcher)
    progress.begin("order")
    for share in (0.3, None, 0.1, 0.6):
        progress.tick(share)
    progress.tick(1.0)  # not done before its end
    progress.end()
    progress.begin("trim")
    assert watcher.told == [("order", s) for s in (None, 0.3, 0.3, 0.3, 0.6, 0.99, 1.0)] + [("trim", None)]


@pytest.mark.parametrize(
    ("now", "share"), [(1000.0, 0.0), (10.0, 2 / 3), (1.0, 1.0), (0.0, 1.0), (1e9, 0.0), (31.6227766, 0.5)]
)
def test_share_of_a_way_that_shrinks_by_factors(now, share):
    assert share_of_way(1000.0, now, 1.0) == pytest.approx(share)


def test_a_solid_tells_and_can_be_called_off():
    relief = rel.make_relief(to_mesh(bust(12)), rel.ReliefParams(k=8))
    watcher = Watcher()
    rel.make_solid(relief, on_progress=watcher)
    assert watcher.stages() == ["solid"]
    assert watcher.shares("solid")[-1] == 1.0
    with pytest.raises(rel.Cancelled, match="in the stage solid"):
        rel.make_solid(relief, on_progress=Watcher(stop_in="solid", after=2))
