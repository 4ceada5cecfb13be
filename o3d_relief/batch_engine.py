"""Where the tasks of a batch run: workers of this machine or of a Dask cluster, through joblib, or of Ray."""

from __future__ import annotations

import socket
import warnings
from collections.abc import Callable, Generator, Iterator, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from typing import Any

from o3d_relief.batch_entry import BatchEntry
from o3d_relief.batch_recipe import BatchTask
from o3d_relief.batch_task import MOST_ATTEMPTS, run_task
from o3d_relief.errors import ParameterError, ReliefError
from o3d_relief.param_checks import check_whole

__all__ = ["ENGINES", "Engine", "check_engine", "open_engine"]

ENGINES = ("loky", "dask", "ray")

_PATIENCE = 60
"""Seconds in which a cluster must have a worker."""


Entries = Generator[BatchEntry, None, None]


@dataclass(frozen=True, kw_only=True)
class Engine:
    """Workers that are ready.

    Attributes
    ----------
    run : callable
        Takes a sequence of BatchTask and yields what became of each, in the order in which they are done.
        Closing it ends what is under way.
    lost : tuple of exception types
        What it raises where a worker was lost and its task with it.
    """

    run: Callable[[Sequence[BatchTask]], Entries]
    lost: tuple[type[BaseException], ...]


def check_engine(engine: str, scheduler: str | None, jobs: int | None) -> None:
    """Check, before any work, what says where the tasks run.

    Parameters
    ----------
    engine, scheduler, jobs
        As of `open_engine`.

    Raises
    ------
    ParameterError
        Another engine, an address for one that has none, or a number of jobs that is not positive and whole.
    """
    if jobs is not None:
        check_whole("jobs", jobs)
    if engine not in ENGINES:
        raise ParameterError(f"engine must be one of {', '.join(ENGINES)}. Got {engine!r} instead.")
    if scheduler is not None and engine == "loky":
        raise ParameterError("scheduler is the address of a cluster: it needs engine dask or ray.")


@contextmanager
def open_engine(engine: str, scheduler: str | None, jobs: int | None) -> Iterator[Engine]:
    """Find the workers, and let them go in the end; `check_engine` comes first.

    Parameters
    ----------
    engine : "loky", "dask" or "ray"
    scheduler : str, optional
        Address of the cluster; where omitted, Dask and Ray start one on this machine.
    jobs : int, optional
        Reliefs that are made at the same time, at most; one for each core or worker where omitted.

    Raises
    ------
    ReliefError
        The engine is not installed, or its cluster does not answer.
    """
    with ExitStack() as stack:
        yield {"loky": _loky, "dask": _dask, "ray": _ray}[engine](scheduler, jobs, stack)


def _loky(_scheduler: str | None, jobs: int | None, _stack: ExitStack) -> Engine:
    from joblib import Parallel, cpu_count
    from joblib.externals.loky.process_executor import BrokenProcessPool

    jobs = jobs or cpu_count()

    def parallel() -> Any:
        # A single job would run in this process, and could take it along: two workers, and work for one.
        return Parallel(
            n_jobs=max(jobs, 2),
            backend="loky",
            return_as="generator_unordered",
            batch_size=1,
            pre_dispatch=jobs,
        )

    return Engine(run=_through_joblib(parallel), lost=(BrokenProcessPool,))


def _dask(scheduler: str | None, jobs: int | None, stack: ExitStack) -> Engine:
    try:
        from distributed import Client, LocalCluster
        from distributed import TimeoutError as TooLate
        from distributed.scheduler import KilledWorker
    except ImportError as error:
        raise ReliefError("The engine dask is not installed: pip install 'o3d-relief[dask]'.") from error
    from joblib import Parallel, cpu_count, parallel_config

    if scheduler is None:
        cluster = LocalCluster(
            n_workers=jobs or cpu_count(), threads_per_worker=1, dashboard_address=None, memory_limit=None
        )
        scheduler = stack.enter_context(cluster).scheduler_address
    try:
        client = stack.enter_context(Client(scheduler, set_as_default=False))
        client.wait_for_workers(1, timeout=_PATIENCE)
    except (OSError, ValueError, TooLate) as error:
        raise ReliefError(
            f"The Dask scheduler at {scheduler} does not answer, or has no workers ({error}): start it with "
            "dask scheduler, and workers with dask worker ADDRESS --nthreads 1."
        ) from error

    def allowed_failures(dask_scheduler: Any) -> int:  # in here, it goes to a scheduler without this package
        return int(dask_scheduler.allowed_failures)

    patience = client.run_on_scheduler(allowed_failures)
    if patience < MOST_ATTEMPTS:
        raise ReliefError(
            f"The Dask scheduler at {scheduler} gives a task up after {patience} lost workers, too early to "
            "tell which input is to blame: start it with "
            f"DASK_DISTRIBUTED__SCHEDULER__ALLOWED_FAILURES={MOST_ATTEMPTS}."
        )

    def parallel() -> Any:
        with parallel_config(backend="dask", client=client):
            return Parallel(
                n_jobs=-1, return_as="generator_unordered", batch_size=1, pre_dispatch=jobs or "all"
            )

    return Engine(run=_through_joblib(parallel), lost=(KilledWorker,))


def _through_joblib(parallel: Callable[[], Any]) -> Callable[[Sequence[BatchTask]], Entries]:
    """Return what runs tasks in a new joblib.Parallel each time."""
    from joblib import delayed

    def run(tasks: Sequence[BatchTask]) -> Entries:
        results = parallel()(delayed(run_task)(task) for task in tasks)
        try:
            for entry in results:  # noqa: UP028, which would close it, too, and let its warning out
                yield entry
        finally:
            with warnings.catch_warnings():
                # What is under way when the caller has had enough is meant to end.
                warnings.filterwarnings("ignore", category=UserWarning, module="joblib")
                results.close()

    return run


def _knock(address: str) -> None:
    """Connect to a Ray cluster; OSError where nobody is there. Ray itself would try for minutes."""
    host, _, port = address.removeprefix("ray://").rpartition(":")
    if host and port.isdigit():
        socket.create_connection((host, int(port)), timeout=_PATIENCE).close()


def _ray(scheduler: str | None, jobs: int | None, stack: ExitStack) -> Engine:
    # Not through joblib: its Ray backend returns nothing before all is done.
    try:
        import ray
    except ImportError as error:
        raise ReliefError("The engine ray is not installed: pip install 'o3d-relief[ray]'.") from error

    where = {"num_cpus": jobs, "include_dashboard": False} if scheduler is None else {"address": scheduler}
    try:
        if scheduler is not None:
            _knock(scheduler)
        ray.init(**where, log_to_driver=False, logging_level="error")
    except (OSError, ValueError, RuntimeError) as error:
        raise ReliefError(
            f"The Ray cluster at {scheduler} does not answer ({error}): start it with ray start --head."
        ) from error
    stack.callback(ray.shutdown)
    # Ray begins a task again whose worker was lost; the task itself knows when to give up.
    remote = ray.remote(num_cpus=1, max_retries=MOST_ATTEMPTS)(run_task)

    def run(tasks: Sequence[BatchTask]) -> Entries:
        waiting = list(tasks)
        running: list[Any] = []
        try:
            while waiting or running:
                while waiting and (jobs is None or len(running) < jobs):
                    running.append(remote.remote(waiting.pop(0)))
                done, running = ray.wait(running)
                yield from ray.get(done)
        finally:
            for task in running:
                ray.cancel(task, force=True)

    return Engine(run=run, lost=(ray.exceptions.RayError,))
