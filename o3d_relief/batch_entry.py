"""What became of one input of a batch: a line of its manifest."""

from __future__ import annotations

import json
from dataclasses import asdict, dataclass
from hashlib import sha256
from pathlib import Path
from typing import Any

__all__ = ["PICTURES", "BatchEntry"]

PICTURES = "pictures"
"""The folder, in that of the batch, with a picture of each relief."""


@dataclass(frozen=True, kw_only=True)
class BatchEntry:
    """What became of one input.

    Attributes
    ----------
    input : str
        The file, with its whole path.
    output : str
        Name of the relief in the folder of the batch.
    status : "made" or "failed"
    seconds : float
        What it took, reading and writing included.
    depth : float or None
        Of the relief, in the input's unit.
    triangles : int or None
        Of the relief.
    certificate : dict or None
        What was measured on the relief, as in `Relief.report`; None where nothing was measured.
    error : str or None
        A sentence that says why there is no relief.
    notes : tuple of str
        What was left out of the input, or does not fit into the output's format.
    attempts : int
        How often it was begun: more than once where a worker was lost.
    input_bytes, input_mtime_ns : int
        Size and time of the last change of the input, -1 where it is missing.
    recipe : str
        SHA-256 of parameters, view, format and version of the package.
    output_sha256 : str or None
        Of the relief's file.
    """

    input: str
    output: str
    status: str
    seconds: float
    depth: float | None = None
    triangles: int | None = None
    certificate: dict[str, Any] | None = None
    error: str | None = None
    notes: tuple[str, ...] = ()
    attempts: int = 1
    input_bytes: int = -1
    input_mtime_ns: int = -1
    recipe: str = ""
    output_sha256: str | None = None

    @property
    def made(self) -> bool:
        """Whether there is a relief."""
        return self.status == "made"

    @property
    def failures(self) -> tuple[str, ...]:
        """What the certificate says does not hold, a sentence each."""
        return () if self.certificate is None else tuple(self.certificate["failures"])

    def line(self) -> str:
        """Return the line of the manifest."""
        return json.dumps(asdict(self)) + "\n"

    @classmethod
    def from_line(cls, line: str) -> BatchEntry:
        """Read a line of a manifest; ValueError where it is none."""
        values = json.loads(line)
        try:
            entry = cls(**(values | {"notes": tuple(values["notes"])}))
        except (TypeError, KeyError) as error:
            raise ValueError(f"not a line of a batch ({error})") from error
        if entry.certificate is not None and not _is_certificate(entry.certificate):
            raise ValueError(f"not a line of a batch (its certificate is {entry.certificate!r})")
        return entry

    def holds(self, folder: Path, recipe: str) -> bool:
        """Tell whether the relief is there, whole, and what input and recipe would give again.

        Parameters
        ----------
        folder : Path
            Of the batch.
        recipe : str
        """
        if not self.made or self.recipe != recipe:
            return False
        try:
            found = Path(self.input).stat()
            if (found.st_size, found.st_mtime_ns) != (self.input_bytes, self.input_mtime_ns):
                return False
            picture = folder / PICTURES / f"{Path(self.output).stem}.png"
            written = (folder / self.output).read_bytes()
        except OSError:
            return False  # something is missing
        return picture.is_file() and sha256(written).hexdigest() == self.output_sha256


def _is_certificate(value: object) -> bool:
    failures = value.get("failures") if isinstance(value, dict) else None
    return isinstance(failures, list) and all(isinstance(sentence, str) for sentence in failures)
