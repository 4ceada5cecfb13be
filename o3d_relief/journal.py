"""What keeps the records of a run."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import TypeVar

from o3d_relief.progress import OnProgress, Progress
from o3d_relief.records import StageRecord

__all__ = ["Journal", "OnStage"]

OnStage = Callable[[StageRecord], None]
_Record = TypeVar("_Record", bound=StageRecord)


class Journal:
    """Keeps the records, gives each the time since the one before and tells the caller.

    Parameters
    ----------
    on_stage : callable, optional
        Called with each record.
    stages : mapping of str to StageRecord, optional
        Records of what came before.
    on_progress : callable, optional
        Told how far the stages are, see `o3d_relief.progress`.
    """

    def __init__(
        self,
        on_stage: OnStage | None,
        stages: Mapping[str, StageRecord] | None = None,
        on_progress: OnProgress | None = None,
    ) -> None:
        self.stages: dict[str, StageRecord] = dict(stages or {})
        self._on_stage = on_stage
        self._progress = Progress(on_progress)
        self.begin, self.tick = self._progress.begin, self._progress.tick
        self._since = time.perf_counter()

    def keep(self, record: _Record) -> _Record:
        """Keep a record.

        Parameters
        ----------
        record : StageRecord

        Returns
        -------
        StageRecord
            The record with its time.

        Raises
        ------
        Cancelled
            The caller has called the work off.
        """
        timed = replace(record, seconds=time.perf_counter() - self._since)
        self._progress.end()
        self.stages[timed.name] = timed
        if self._on_stage is not None:
            self._on_stage(timed)
        self._since = time.perf_counter()
        return timed
