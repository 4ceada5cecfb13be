"""The errors that this package raises: one clear sentence each."""

__all__ = [
    "Cancelled",
    "DisplayError",
    "FileError",
    "MeshError",
    "ParameterError",
    "ReliefError",
    "SolverError",
]


class ReliefError(Exception):
    """Base of every error that this package raises on purpose."""


class ParameterError(ReliefError, ValueError):
    """A parameter is out of range, or contradicts another one or the scene."""


class MeshError(ReliefError, ValueError):
    """A mesh from which no relief can be made."""


class FileError(ReliefError, OSError):
    """A file that cannot be read or written."""


class Cancelled(ReliefError):  # noqa: N818, it is no error of anybody
    """The work was called off by the caller's `on_progress`."""


class SolverError(ReliefError, RuntimeError):
    """A linear system that could not be solved to the accuracy asked for."""


class DisplayError(ReliefError, RuntimeError):
    """A window that cannot be opened here."""
