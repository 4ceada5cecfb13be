"""Many scans at once: a relief of each, on the workers of one machine or of many."""

from __future__ import annotations

from collections.abc import Callable, Generator, Iterable
from contextlib import AbstractContextManager, closing
from dataclasses import dataclass
from pathlib import Path

from o3d_relief.batch_engine import Engine, check_engine, open_engine
from o3d_relief.batch_entry import PICTURES, BatchEntry
from o3d_relief.batch_inputs import find_inputs
from o3d_relief.batch_lock import sole_batch
from o3d_relief.batch_manifest import Manifest, Notes
from o3d_relief.batch_recipe import BatchTask, Recipe, open_tasks
from o3d_relief.batch_sheet import remove_sheets, write_sheets
from o3d_relief.batch_task import MOST_ATTEMPTS, lost_entry
from o3d_relief.errors import FileError, ParameterError, ReliefError
from o3d_relief.files import check_folder, clear_leftovers
from o3d_relief.param_checks import given
from o3d_relief.params import ReliefParams, View
from o3d_relief.progress import OnProgress, Progress
from o3d_relief.scan_params import ScanParams

__all__ = ["Batch", "make_reliefs"]

OnDone = Callable[[BatchEntry], None]


@dataclass(frozen=True, kw_only=True)
class Batch:
    """What became of many inputs.

    Attributes
    ----------
    entries : tuple of BatchEntry
        One for each input, in order.
    already_done : int
        Of these, reliefs of an earlier run that were kept.
    sheets : tuple of Path
        The contact sheets.
    """

    entries: tuple[BatchEntry, ...]
    already_done: int
    sheets: tuple[Path, ...]

    @property
    def failed(self) -> tuple[BatchEntry, ...]:
        """The entries of inputs of which there is no relief."""
        return tuple(entry for entry in self.entries if not entry.made)


def make_reliefs(
    inputs: Iterable[str | Path],
    out: str | Path,
    params: ReliefParams | None = None,
    *,
    view: View | None = None,
    scan: ScanParams | None = None,
    ending: str = ".ply",
    jobs: int | None = None,
    engine: str = "loky",
    scheduler: str | None = None,
    max_triangles: int | None = None,
    certificates: bool = False,
    strict: bool = False,
    on_done: OnDone | None = None,
    on_progress: OnProgress | None = None,
) -> Batch:
    """Make a relief of each of many files.

    The folder gets the reliefs, `manifest.jsonl` with a line for each input, a picture of each relief in
    `pictures` and contact sheets. Reliefs that are there already, of the same input with the same parameters,
    are not made again: after an interruption, however rude, the same call goes on where it was. An input from
    which no relief can be made is noted and the rest goes on; one that costs its worker the life is tried a
    second time, alone.

    Parameters
    ----------
    inputs : iterable of path
        Meshes and point clouds. A folder stands for all files in it that can be read.
    out : path
        Folder, which is made where it is missing; on a cluster all workers must see it, and the inputs, by
        the same name. Reliefs are called like their inputs; of several with one name, the later get a number.
    params : ReliefParams, optional
    view : View, optional
    scan : ScanParams, optional
        For point clouds.
    ending : str
        Of the reliefs' files: .ply, .obj, .stl or .glb.
    jobs : int, optional
        Reliefs that are made at the same time; one for each core, or worker of the cluster, where omitted.
    engine : "loky", "dask" or "ray"
        joblib's own processes on this machine, or a cluster.
    scheduler : str, optional
        Address of the cluster; where omitted, Dask and Ray start one on this machine.
    max_triangles : int, optional
        Larger meshes are refused; 10,000,000 where omitted.
    certificates : bool
        Make a certificate of each relief, for the manifest; it takes time and memory of its own. Reliefs of
        an earlier run that have none are made again, those that have one are not.
    strict : bool
        Make certificates; a relief whose certificate is not clean is not written, one of an earlier run is
        removed with its picture, and the input counts as failed.
    on_done : callable, optional
        Called with the entry of each input as soon as it is done; not for those that were done already.
    on_progress : callable, optional
        Called with "batch" and the share of the inputs that are done, at the start and after each, and with 1
        at the end. Where it returns False, or raises, the workers are ended; what is done stays.

    Returns
    -------
    Batch

    Raises
    ------
    ParameterError
        A parameter out of its range.
    FileError
        The folder cannot be used, or another batch is under way in it.
    ReliefError
        The engine is not installed, or its cluster does not answer.
    Cancelled
        `on_progress` returned False.
    """
    check_engine(engine, scheduler, jobs)
    recipe = Recipe(
        params=given("params", params, ReliefParams),
        view=given("view", view, View),
        scan=given("scan", scan, ScanParams),
        ending=_checked_ending(ending),
        max_triangles=max_triangles,
        strict=strict,
        certificates=certificates,
    )
    sources = find_inputs(inputs)
    folder = _made_folder(Path(out))
    with sole_batch(folder):
        return _fill(
            folder,
            sources,
            recipe,
            lambda: open_engine(engine, scheduler, jobs),
            on_done=on_done,
            progress=Progress(on_progress),
        )


def _fill(
    folder: Path,
    sources: list[str],
    recipe: Recipe,
    opened: Callable[[], AbstractContextManager[Engine]],
    *,
    on_done: OnDone | None,
    progress: Progress,
) -> Batch:
    """Make what the folder has not, with the workers that `opened` calls."""
    manifest = Manifest(folder)  # first: from here on, workers of a killed batch write no more
    for place in (folder, folder / PICTURES):
        clear_leftovers(place)
    _, tasks = open_tasks(sources, folder, manifest.entries, recipe, manifest.run)
    done = len(sources) - len(tasks)
    progress.begin("batch")
    progress.tick(done / len(sources))
    try:
        if tasks:
            with (
                opened() as workers,
                closing(_run(workers, tasks, manifest.notes)) as entries,
            ):
                for count, entry in enumerate(entries, start=done + 1):
                    manifest.add(entry)
                    if recipe.strict and not entry.made:
                        remove_sheets(folder)  # they may show what was refused
                    if on_done is not None:
                        on_done(entry)
                    progress.tick(count / len(sources))
    finally:
        for place in (folder, folder / PICTURES):
            clear_leftovers(place)
        manifest.settle(sources)
    sheets = write_sheets(folder, manifest.entries.values())
    progress.end()
    return Batch(
        entries=tuple(manifest.entries[source] for source in sources), already_done=done, sheets=tuple(sheets)
    )


def _checked_ending(ending: str) -> str:
    from o3d_relief.scene.write import WRITABLE

    if ending not in WRITABLE:
        raise ParameterError(f"ending must be one of {', '.join(WRITABLE)}. Got {ending!r} instead.")
    return ending


def _made_folder(folder: Path) -> Path:
    """Make the folder of a batch; return its whole path."""
    for place in (folder, folder / PICTURES):
        check_folder(place)
    try:
        (folder / PICTURES).mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise FileError(f"The folder {folder} cannot be made: {error.strerror}.") from error
    return folder.resolve()


def _run(workers: Engine, tasks: list[BatchTask], notes: Notes) -> Generator[BatchEntry, None, None]:
    """Run tasks, those again whose workers were lost; yield what became of each."""
    waiting = {task.input: task for task in tasks}
    while waiting:
        before = len(waiting)
        try:
            with closing(workers.run(list(waiting.values()))) as entries:
                for entry in entries:
                    del waiting[entry.input]
                    yield entry
        except workers.lost:
            for entry in notes.kept():  # done, and not heard of any more
                if waiting.pop(entry.input, None) is not None:
                    yield entry
            # One of those that were under way has cost the workers their lives: alone, it will show.
            for task in [task for task in waiting.values() if notes.attempts(task.input)]:
                del waiting[task.input]
                yield _run_alone(workers, task, notes)
            if len(waiting) == before:
                raise ReliefError(
                    "The workers end before they begin any work: look for what they have written, or use "
                    "fewer of them."
                ) from None


def _run_alone(workers: Engine, task: BatchTask, notes: Notes) -> BatchEntry:
    while notes.attempts(task.input) < MOST_ATTEMPTS:
        before = notes.attempts(task.input)
        try:
            with closing(workers.run([task])) as entries:
                return next(entries)
        except workers.lost:
            kept = [entry for entry in notes.kept() if entry.input == task.input]
            if kept:
                return kept[0]
            if notes.attempts(task.input) == before:
                break
    return lost_entry(task, notes)
