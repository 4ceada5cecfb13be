"""Damaged files, meshes and clouds, each in a process that may die of it: a relief, or an error of ours.

`benchmarks/fuzz.py` runs more of them.
"""

from collections.abc import Iterator
from typing import Any

import pytest
from hypothesis import HealthCheck, given, settings

from fuzz_cases import cloud_cases, file_cases, mesh_cases
from fuzz_clouds import CLOUDS
from fuzz_files import SAMPLES
from fuzz_meshes import SHAPES
from fuzz_worker import Case, Pool

REPEATABLE = settings(derandomize=True, database=None, deadline=None, suppress_health_check=list(HealthCheck))


@pytest.fixture(scope="module")
def pool() -> Iterator[Pool]:
    pool = Pool()
    yield pool
    pool.close()


def _check(pool: Pool, case: Case) -> None:
    outcome = pool.run(case)
    assert not outcome.startswith("BUG"), f"{case.name}\n{outcome}"


@pytest.mark.parametrize("name", [*SAMPLES, *CLOUDS])
def test_undamaged_files_give_a_relief(pool, name):
    assert pool.run(Case(name=name, files=(SAMPLES | CLOUDS)[name](), params={"k": 4})) == "relief"


@pytest.mark.parametrize("name", SHAPES)
def test_undamaged_meshes_give_a_relief(pool, name):
    vertices, faces = SHAPES[name]
    arrays = {"vertices": vertices, "faces": faces}
    assert pool.run(Case(name=name, arrays=arrays, params={"k": 2}, picture=True)) == "relief"


@pytest.mark.slow
def test_damaged_files(pool):
    @settings(REPEATABLE, max_examples=260)
    @given(file_cases())
    def run(case: Case) -> None:
        _check(pool, case)

    run()


@pytest.mark.slow
def test_damaged_meshes(pool):
    @settings(REPEATABLE, max_examples=180)
    @given(mesh_cases())
    def run(case: Case) -> None:
        _check(pool, case)

    run()


@pytest.mark.slow
def test_damaged_clouds(pool):
    @settings(REPEATABLE, max_examples=80)
    @given(cloud_cases())
    def run(case: Case) -> None:
        _check(pool, case)

    run()


class TestPool:
    """What the worker reports of cases that do what no case should."""

    def test_a_death_is_named_and_survived(self, pool):
        assert pool.run(_trap("__import__('os')._exit(7)")) == "BUG: the process died with exit code 7"
        assert pool.run(Case(name="obj", files=SAMPLES["obj"](), params={"k": 4})) == "relief"

    @pytest.mark.parametrize(
        ("code", "sign"),
        [
            ("1 / 0", "ZeroDivisionError"),
            ("__import__('warnings').warn('odd')", "UserWarning: odd"),
            ("__import__('os').write(1, b'noise')", "something was printed: b'noise"),
        ],
    )
    def test_what_is_raised_warned_of_or_printed_is_a_bug(self, pool, code, sign):
        outcome = pool.run(_trap(code))
        assert outcome.startswith("BUG")
        assert sign in outcome

    @pytest.mark.parametrize("code", ["__import__('time').sleep(60)", "[0 for _ in iter(int, 1)]"])
    def test_a_case_that_takes_too_long_is_ended(self, pool, monkeypatch, code):
        monkeypatch.setattr("fuzz_worker.SECONDS", 0.5)
        monkeypatch.setattr("fuzz_worker._WAIT", 2.0)
        assert pool.run(_trap(code)) == "BUG: it takes more than 0.5 s"


class _Trap(dict):
    """Arrays that do something when they are looked at."""

    def __init__(self, code: str) -> None:
        vertices, faces = SHAPES["hills"]
        super().__init__(vertices=vertices, faces=faces)
        self.code = code

    def __getitem__(self, name: str) -> Any:
        eval(self.code)
        return super().__getitem__(name)

    def __reduce__(self) -> Any:
        return _Trap, (self.code,)


def _trap(code: str) -> Case:
    return Case(name="trap", arrays=_Trap(code), params={"k": 2})
