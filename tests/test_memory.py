import sys
import threading

import pytest

from o3d_relief import memory
from o3d_relief.memory import give_back, memory_kept


@pytest.fixture
def calls(monkeypatch):
    """What would have been asked of malloc."""
    made = []
    monkeypatch.setattr(
        memory,
        "_calls",
        lambda: (lambda *setting: made.append(setting) or 1, lambda pad: made.append("trim") or 1),
    )
    return made


def test_memory_is_kept_within_and_given_back_behind(calls):
    with memory_kept():
        assert calls == list(memory._KEEPING)
    assert calls == [*memory._KEEPING, *memory._USUAL, "trim"]


def test_the_outermost_block_decides(calls):
    with memory_kept(), memory_kept():
        assert calls == list(memory._KEEPING)
    assert calls.count("trim") == 1


def test_the_last_thread_decides(calls):
    inside, done = threading.Event(), threading.Event()

    def other():
        with memory_kept():
            inside.set()
            done.wait(10)

    thread = threading.Thread(target=other, daemon=True)
    thread.start()
    assert inside.wait(10)
    with memory_kept():
        pass
    early = "trim" in calls
    done.set()
    thread.join(10)
    assert not early
    assert calls[-1] == "trim"


def test_some_is_given_back_in_between(calls):
    with memory_kept():
        give_back()
        assert calls == [*memory._KEEPING, "trim"]


def test_an_error_gives_it_back(calls):
    with pytest.raises(ValueError, match="no"), memory_kept():
        raise ValueError("no")
    assert calls[-1] == "trim"


def test_settings_of_the_environment_are_left_alone(monkeypatch):
    monkeypatch.setenv("MALLOC_MMAP_MAX_", "10")
    assert memory._calls() is None
    with memory_kept():
        assert memory._blocks.entered == 0


@pytest.mark.skipif(sys.platform != "linux", reason="glibc is Linux's")
def test_malloc_knows_the_settings(monkeypatch):
    for name in memory._OWN_CHOICE:
        monkeypatch.delenv(name, raising=False)
    calls = memory._calls()
    if calls is None:
        pytest.skip("not glibc")
    mallopt, _ = calls
    assert [mallopt(*setting) for setting in (*memory._KEEPING, *memory._USUAL)] == [1] * 5


def test_other_systems_are_left_alone(monkeypatch):
    monkeypatch.setattr("sys.platform", "darwin")
    assert memory._calls() is None
