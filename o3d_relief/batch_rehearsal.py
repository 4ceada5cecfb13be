"""What a batch would make and what would fail, before the work; nothing is written."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from o3d_relief.batch_entry import PICTURES
from o3d_relief.batch_inputs import find_inputs
from o3d_relief.batch_lock import check_sole
from o3d_relief.batch_manifest import read_entries
from o3d_relief.batch_recipe import BatchTask, Recipe, open_tasks
from o3d_relief.batch_task import error_sentence, read_input
from o3d_relief.files import check_folder

if TYPE_CHECKING:
    from o3d_relief.solid.estimate import Estimate

__all__ = ["Rehearsal", "rehearse_reliefs"]


@dataclass(frozen=True, kw_only=True)
class Rehearsal:
    """What would become of an input.

    Attributes
    ----------
    input : str
        The file, with its whole path.
    output : str
        Name of the relief in the folder.
    estimate : Estimate or None
        What the relief would measure; None where there is one already, and where none can be made.
    error : str or None
        Why none can be made.
    """

    input: str
    output: str
    estimate: Estimate | None = None
    error: str | None = None

    @property
    def already_done(self) -> bool:
        """Whether the relief of an earlier run would be kept."""
        return self.estimate is None and self.error is None


def rehearse_reliefs(inputs: Iterable[str | Path], out: str | Path, recipe: Recipe) -> Iterator[Rehearsal]:
    """Go through the inputs of a batch up to its long work, one after the other.

    Point clouds are meshed: their sizes are not known before. What certificates would refuse is not.

    Parameters
    ----------
    inputs : iterable of path
        As in `make_reliefs`.
    out : path
    recipe : Recipe

    Yields
    ------
    Rehearsal
        Of each input, in order.

    Raises
    ------
    ParameterError, FileError
        What `make_reliefs` would refuse of inputs and folder.
    """
    sources = find_inputs(inputs)
    for place in (Path(out), Path(out) / PICTURES):
        check_folder(place)
    folder = Path(out).resolve()
    check_sole(folder)
    names, tasks = open_tasks(sources, folder, read_entries(folder), recipe)
    waiting = {task.input: task for task in tasks}
    for source in sources:
        if source in waiting:
            yield _rehearse(waiting[source])
        else:
            yield Rehearsal(input=source, output=names[source])


def _rehearse(task: BatchTask) -> Rehearsal:
    from o3d_relief.rehearsal import check_scene
    from o3d_relief.scene.scan import scan_points
    from o3d_relief.solid.estimate import estimate_relief

    recipe = task.recipe
    try:
        scene, scan, _ = read_input(Path(task.input), recipe.scan)
        mesh = scene if scan is None else scan_points(scene, scan, view=recipe.view).mesh
        check_scene(mesh, recipe.params, recipe.view, recipe.max_triangles)
        found = estimate_relief(mesh, recipe.params, recipe.view, max_triangles=recipe.max_triangles)
    except Exception as error:  # noqa: BLE001, whatever is wrong with one input, the others are looked at
        return Rehearsal(input=task.input, output=task.output, error=error_sentence(error))
    return Rehearsal(input=task.input, output=task.output, estimate=found)
