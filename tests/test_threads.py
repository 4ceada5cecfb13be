import threading
import time
from concurrent.futures import Executor, Future
from contextlib import contextmanager

import numpy as np
import pytest

import o3d_relief as rel
from o3d_relief import pipeline, threads
from o3d_relief.bounds import ahead, correction
from o3d_relief.threads import each, one_beside
from shapes import bust, grid, joined, moved, to_mesh

PARAMS = rel.ReliefParams(k=24, beta=0.8)


class AtOnce(Executor):
    """Does everything as soon as it is asked for, in the same thread."""

    def submit(self, function, /, *args, **kwargs):
        done = Future()
        done.set_result(function(*args, **kwargs))
        return done


def scene():
    """Four bodies close to a plate: the order is corrected in several regions."""
    plate = grid(31, size=160)
    places = [(-48, -48, 45), (48, -48, 45), (-48, 48, 45), (48, 48, 45)]
    return to_mesh(joined(plate, *(moved(bust(16), place) for place in places)))


def alive():
    return [thread for thread in threading.enumerate() if thread.name.startswith("o3d-relief")]


def test_results_come_in_the_order_of_the_items():
    def slow_at_first(item):
        time.sleep(0.02 * (3 - item))
        return item, threading.current_thread()

    results = each(slow_at_first, range(4))
    assert [item for item, _ in results] == [0, 1, 2, 3]
    assert each(slow_at_first, [3]) == [(3, threading.current_thread())]
    assert each(slow_at_first, []) == []
    assert alive() == []


def test_several_at_a_time(monkeypatch):
    monkeypatch.setattr(threads.os, "cpu_count", lambda: 2)
    both = threading.Barrier(2)
    each(lambda _: both.wait(10), range(2))  # would break if one waited for the other to end


def test_an_error_of_one_of_them_is_raised():
    with pytest.raises(ZeroDivisionError):
        each(lambda item: 1 // item, [1, 0, 2])
    assert alive() == []


def test_what_has_not_begun_is_dropped_at_the_end():
    begun, go, done = threading.Event(), threading.Event(), []

    def first():
        begun.set()
        go.wait(10)
        done.append("first")

    def fail():
        with one_beside() as thread:
            thread.submit(first)
            thread.submit(done.append, "second")
            begun.wait(10)
            threading.Timer(0.05, go.set).start()
            raise ValueError("no")

    with pytest.raises(ValueError, match="no"):
        fail()
    assert done == ["first"]
    assert alive() == []


def test_a_relief_is_the_same_with_and_without_them(monkeypatch):
    @contextmanager
    def nobody_beside():
        yield AtOnce()

    regions = []

    def one_by_one(function, items):
        regions.append(len(items))
        return [function(item) for item in items]

    mesh = scene()
    monkeypatch.setattr(threads.os, "cpu_count", lambda: 4)
    monkeypatch.setattr(correction, "_SMALL", 1)
    usual = rel.make_relief(mesh, PARAMS)
    monkeypatch.setattr(pipeline, "one_beside", nobody_beside)
    monkeypatch.setattr(correction, "each", one_by_one)
    alone = rel.make_relief(mesh, PARAMS)
    assert max(regions) > 1
    assert usual.stages["order"].counts == alone.stages["order"].counts
    for stage in ("construction", "restoration", "order"):
        assert usual.stages[stage].z.tobytes() == alone.stages[stage].z.tobytes()
    assert np.asarray(usual.mesh.vertices).tobytes() == np.asarray(alone.mesh.vertices).tobytes()


def test_no_thread_is_left_wherever_the_work_ends_and_only_the_caller_s_tells():
    mesh = scene()
    names = list(rel.make_relief(mesh, PARAMS).stages)
    assert alive() == []
    for name in names:
        told = set()

        def stop(stage, _share, *, name=name, told=told):
            told.add(threading.current_thread())
            return stage != name

        with pytest.raises(rel.Cancelled, match=f"in the stage {name}"):
            rel.make_relief(mesh, PARAMS, on_progress=stop)
        assert told == {threading.current_thread()}
        assert alive() == []


@pytest.mark.parametrize("name", ["edges_that_turn", "silhouette_pairs", "column_pairs", "Between"])
def test_an_error_beside_is_raised_as_it_is(monkeypatch, name):
    def broken(*_args, **_kwargs):
        raise rel.SolverError(f"{name} is broken.")

    monkeypatch.setattr(ahead, name, broken)
    with pytest.raises(rel.SolverError, match=f"^{name} is broken.$") as caught:
        rel.make_relief(scene(), PARAMS)
    assert caught.value.__context__ is None
    assert alive() == []


def test_the_paper_s_method_and_the_bounded_mode_start_none(monkeypatch):
    started = []
    monkeypatch.setattr(pipeline, "Ahead", lambda *_: started.append("ahead"))
    rel.make_relief(scene(), rel.ReliefParams.paper(k=8))
    rel.make_relief(to_mesh(bust(8)), rel.ReliefParams(depth=10.0))
    assert started == []
