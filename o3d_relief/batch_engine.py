"""Where the tasks of a batch run: workers of this machine, or a Dask or Ray cluster, all through joblib."""

from __future__ import annotations

from collections.abc import Callable, Generator, Iterator, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from typing import Any

from o3d_relief.batch_manifest import BatchEntry
from o3d_relief.batch_task import MOST_ATTEMPTS, BatchTask, run_task
from o3d_relief.errors import ParameterError, ReliefError

__all__ = ["ENGINES", "Engine", "open_engine"]

ENGINES = ("loky", "dask", "ray")


@dataclass(frozen=True, kw_only=True)
class Engine:
    """Workers that are ready.

    Attributes
    ----------
    parallel : callable
        Returns a new joblib.Parallel.
    lost : tuple of exception types
        What is raised where a worker was lost and its task with it.
    """

    parallel: Callable[[], Any]
    lost: tuple[type[BaseException], ...]

    def run(self, tasks: Sequence[BatchTask]) -> Generator[BatchEntry, None, None]:
        """Run tasks and yield what became of each, in the order in which they are done.

        Parameters
        ----------
        tasks : sequence of BatchTask

        Yields
        ------
        BatchEntry
        """
        from joblib import delayed

        results = self.parallel()(delayed(run_task)(task) for task in tasks)
        try:
            yield from results
        finally:
            results.close()  # ends what is still under way


@contextmanager
def open_engine(engine: str, scheduler: str | None, jobs: int | None) -> Iterator[Engine]:
    """Find the workers, and let them go in the end.

    Parameters
    ----------
    engine : "loky", "dask" or "ray"
    scheduler : str, optional
        Address of the cluster; where omitted, Dask and Ray start one on this machine.
    jobs : int, optional
        Reliefs that are made at the same time, at most; one for each core or worker where omitted.

    Raises
    ------
    ParameterError
        An address for an engine that has none.
    ReliefError
        The engine is not installed, or its cluster does not answer.
    """
    if engine not in ENGINES:
        raise ParameterError(f"engine must be one of {', '.join(ENGINES)}. Got {engine!r} instead.")
    if scheduler is not None and engine == "loky":
        raise ParameterError("scheduler is the address of a cluster: it needs engine dask or ray.")
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

    return Engine(parallel=parallel, lost=(BrokenProcessPool,))


def _dask(scheduler: str | None, jobs: int | None, stack: ExitStack) -> Engine:
    try:
        from distributed import Client, LocalCluster
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
    except (OSError, ValueError) as error:
        raise ReliefError(
            f"The Dask scheduler at {scheduler} does not answer ({error}): start it with dask scheduler, and "
            "workers with dask worker ADDRESS --nthreads 1."
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

    return Engine(parallel=parallel, lost=(KilledWorker,))


def _ray(scheduler: str | None, jobs: int | None, stack: ExitStack) -> Engine:
    try:
        import ray
        from ray.util.joblib import register_ray
    except ImportError as error:
        raise ReliefError("The engine ray is not installed: pip install 'o3d-relief[ray]'.") from error
    from joblib import Parallel, parallel_config

    try:
        if scheduler is None:
            ray.init(num_cpus=jobs, include_dashboard=False, log_to_driver=False, logging_level="warning")
        else:
            ray.init(address=scheduler, log_to_driver=False, logging_level="warning")
    except (ConnectionError, ValueError, RuntimeError) as error:
        raise ReliefError(f"The Ray cluster {scheduler or ''} cannot be used: {error}") from error
    stack.callback(ray.shutdown)
    register_ray()

    def parallel() -> Any:
        with parallel_config(backend="ray"):
            return Parallel(
                n_jobs=jobs or -1,
                return_as="generator_unordered",
                batch_size=1,
                pre_dispatch=jobs or "all",
            )

    return Engine(parallel=parallel, lost=(ray.exceptions.RayError,))
