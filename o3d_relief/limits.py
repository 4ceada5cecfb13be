"""What is too large is refused before memory is asked for."""

from __future__ import annotations

import sys
from pathlib import Path

from o3d_relief.errors import FileError, MeshError, ParameterError
from o3d_relief.param_checks import check_whole

__all__ = [
    "MAX_TRIANGLES",
    "available_memory",
    "check_field",
    "check_file_size",
    "check_points",
    "check_triangles",
    "field_memory",
    "memory_for",
]

MAX_TRIANGLES = 10_000_000
"""Largest number of triangles that is accepted where no other is given; ten times a full scan."""

_READING = {
    ".ply": 10,
    ".obj": 15,
    ".stl": 10,
    ".off": 21,
    ".glb": 8,
    ".gltf": 8,
    ".pcd": 10,
    ".xyz": 15,
    ".xyzn": 15,
    ".xyzrgb": 15,
    ".pts": 15,
    ".las": 15,
    ".laz": 40,
}
"""Bytes of memory for each byte of a file at the peak of reading it, measured on a million triangles."""

_RELIEF = 700
"""Bytes of memory for each triangle at the peak of making a relief; 400 were measured on 2,000,000 with the
paper's parameters, the guarantees take more."""

_MESHING = 3000
"""Bytes of memory for each point at the peak of meshing a cloud."""

_MOST_PIXELS = 40_000_000
"""Of a height field."""

_FIELD, _UNDER_FIELD = 200, 1200
"""Bytes of memory for each pixel of a height field, and for each where a solid is made of what lies under it;
80 to 120 and 1050 to 1150 were measured on 1,300,000 to 12,000,000 pixels."""

_CONTAINERS = (
    ("/sys/fs/cgroup/memory.max", "/sys/fs/cgroup/memory.stat", "anon"),
    ("/sys/fs/cgroup/memory/memory.limit_in_bytes", "/sys/fs/cgroup/memory/memory.stat", "total_rss"),
)
"""Where Linux tells the limit of a container and what of it is in use, without caches: cgroups 2 and 1."""


def available_memory() -> int:
    """Find out how much memory this process may still have.

    Returns
    -------
    int
        In bytes: what is free on the machine, in the container and under the limit of the process
        (ulimit -v), whichever is least.
    """
    import psutil

    free = [int(psutil.virtual_memory().available)]
    for limit, usage, name in _CONTAINERS:
        try:
            counts = dict(line.split() for line in Path(usage).read_text().splitlines())
            free.append(int(Path(limit).read_text()) - int(counts[name]))
        except (OSError, ValueError, KeyError):  # no container, or one without a limit ("max")
            continue
    if sys.platform != "win32":
        import resource

        most, _ = resource.getrlimit(resource.RLIMIT_AS)
        if most != resource.RLIM_INFINITY:
            free.append(most - int(psutil.Process().memory_info().vms))
    return max(min(free), 0)


def check_file_size(path: Path, size: int) -> None:
    """Refuse a file that would need more memory than there is.

    Parameters
    ----------
    path : Path
        Its ending tells the format.
    size : int
        In bytes.

    Raises
    ------
    FileError
        Too little memory.
    """
    needed, free = size * _READING.get(path.suffix.lower(), 1), available_memory()
    if needed > free:
        raise FileError(
            f"{path} is not read: it would need about {_words(needed)} of memory and {_words(free)} are "
            "free. Reduce the mesh in another program, or use a machine with more memory."
        )


def check_points(count: int) -> None:
    """Refuse a point cloud whose meshing would need more memory than there is.

    Parameters
    ----------
    count : int
        The points that are used.

    Raises
    ------
    MeshError
        Too little memory.
    """
    needed, free = count * _MESHING, available_memory()
    if needed > free:
        raise MeshError(
            f"A mesh of {count:,} points would need about {_words(needed)} of memory and {_words(free)} are "
            "free: use fewer of them (max_points), or a machine with more memory."
        )


def check_triangles(count: int, most: int | None = None) -> None:
    """Refuse a mesh that is too large, or that would need more memory than there is.

    Parameters
    ----------
    count : int
        Its triangles.
    most : int, optional
        The largest number to accept; 10,000,000 where omitted.

    Raises
    ------
    ParameterError
        `most` is not a positive whole number.
    MeshError
        Too many triangles, or too little memory for them.
    """
    most = MAX_TRIANGLES if most is None else check_whole("max_triangles", most)
    if count > most:
        raise MeshError(
            f"The mesh has {count:,} triangles, more than the {most:,} that are accepted (max_triangles): "
            "reduce it first, or accept more."
        )
    if not memory_for(count):
        raise MeshError(
            f"The mesh has {count:,} triangles: a relief of it would need about {_words(count * _RELIEF)} of "
            f"memory and {_words(available_memory())} are free. Reduce it first, or use a machine with more "
            "memory."
        )


def check_field(
    columns: int, rows: int, mm_per_pixel: float, *, about: bool = False, solid: bool = False
) -> None:
    """Refuse a height field of more than 40 million pixels, or of more than there is memory for.

    Parameters
    ----------
    columns, rows : int
    mm_per_pixel : float
        What the sentence asks to make larger.
    about : bool
        Whether the pixels are estimated, which the sentence then says.
    solid : bool
        Whether a solid is made of what lies under it.

    Raises
    ------
    ParameterError
        Too many pixels, or too little memory for them.
    """
    pixels, needed, free = columns * rows, field_memory(columns * rows, solid=solid), available_memory()
    made = (
        f"mm_per_pixel must be larger: {mm_per_pixel:g} makes {'about ' if about else ''}{columns} x {rows} "
        "pixels of this piece"
    )
    if pixels > _MOST_PIXELS:
        raise ParameterError(f"{made}, more than {_MOST_PIXELS:,}.")
    if needed > free:
        raise ParameterError(
            f"{made}, which would need about {_words(needed)} of memory and {_words(free)} are free."
        )


def field_memory(pixels: int, *, solid: bool) -> int:
    """Return the bytes of memory that a height field takes, beside all else.

    Parameters
    ----------
    pixels : int
    solid : bool
        Whether a solid is made of what lies under it.

    Returns
    -------
    int
    """
    return pixels * (_UNDER_FIELD if solid else _FIELD)


def memory_for(triangles: int) -> bool:
    """Tell whether there is memory for a relief of so many triangles.

    Parameters
    ----------
    triangles : int

    Returns
    -------
    bool
    """
    return triangles * _RELIEF <= available_memory()


def _words(size: int) -> str:
    return f"{size / 2**30:.1f} GB" if size >= 2**29 else f"{size / 2**20:.0f} MB"
