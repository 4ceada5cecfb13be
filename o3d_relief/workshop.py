"""From a solid to what mill and printer take: height map, solid without undercuts, tiles."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from o3d_relief.errors import FileError
from o3d_relief.solid.block import solid_under
from o3d_relief.solid.body import Solid
from o3d_relief.solid.formats import write_solids
from o3d_relief.solid.heightmap import height_map_scale, write_height_map
from o3d_relief.solid.heights import HeightField, height_field
from o3d_relief.solid.milling import milled
from o3d_relief.solid.tiles import Tiling, make_tiles
from o3d_relief.workshop_params import MillParams, TileParams

__all__ = ["Work", "tile_files", "work_on", "write_work"]


@dataclass(frozen=True, kw_only=True, eq=False, repr=False)
class Work:
    """What becomes of a solid in the workshop.

    Attributes
    ----------
    solid : Solid
        As it came, or without undercuts.
    field : HeightField or None
        What the mill cuts.
    tiling : Tiling or None
    mill : MillParams or None
    undercut_free : bool
    """

    solid: Solid
    field: HeightField | None
    tiling: Tiling | None
    mill: MillParams | None
    undercut_free: bool

    def report(self) -> dict[str, Any]:
        """Sum up what was made in plain values, for JSON.

        Returns
        -------
        dict
            Empty where nothing was asked for.
        """
        result: dict[str, Any] = {}
        if self.field is not None and self.mill is not None:
            rows, columns = self.field.z.shape
            result["milling"] = {
                **asdict(self.mill),
                **height_map_scale(self.field),
                "undercut_free": self.undercut_free,
                "pixels": [columns, rows],
            }
        if self.tiling is not None:
            result["tiles"] = {
                **self.tiling.counts,
                "pin_mm": self.tiling.pin_mm,
                "pin_length_mm": self.tiling.pin_length_mm,
                "sizes_mm": [tile.solid.size.round(3).tolist() for tile in self.tiling.tiles],
            }
        return result

    def sentences(self) -> list[str]:
        """Tell in words what was made and what to mind."""
        told = []
        if self.field is not None:
            rows, columns = self.field.z.shape
            told.append(f"height field: {columns} x {rows} pixels of {self.field.mm_per_pixel:g} mm")
        if self.tiling is not None:
            counts = self.tiling.counts
            if counts["tiles"] == 1:
                told.append("the piece fits in one tile: it is not cut")
            else:
                told.append(
                    f"{counts['tiles']} tiles in {counts['rows']} rows and {counts['columns']} columns, "
                    f"{counts['pins']} pins of {self.tiling.pin_mm:g} mm"
                )
            if counts["joints_without_pins"]:
                told.append(f"{counts['joints_without_pins']} joints have no room for a pin: glue them")
            if counts["pockets_cut"]:
                told.append(
                    f"seams cut {counts['pockets_cut']} of the holes that the back hangs by: choose another "
                    "size of the tiles"
                )
            if counts["loose"]:
                told.append(f"{counts['loose']} loose parts lie in the tiles: glue them where they belong")
            if counts["unnumbered"]:
                told.append(f"{counts['unnumbered']} tiles have no room for their number")
        return told


def work_on(solid: Solid, *, mill: MillParams | None, undercut_free: bool, tiles: TileParams | None) -> Work:
    """Mill a solid and cut it into tiles, as far as asked for.

    Parameters
    ----------
    solid : Solid
    mill : MillParams or None
        None: no height field.
    undercut_free : bool
        The solid becomes the one under the height field; needs `mill`.
    tiles : TileParams or None

    Returns
    -------
    Work

    Raises
    ------
    ParameterError
        A tool or pixels that do not fit the piece, tiles that cannot be.
    """
    field = None
    if mill is not None:
        field = milled(height_field(solid, mill.mm_per_pixel), mill)
        solid = solid_under(field, solid) if undercut_free else solid
    return Work(
        solid=solid,
        field=field,
        tiling=None if tiles is None else make_tiles(solid, tiles),
        mill=mill,
        undercut_free=undercut_free,
    )


def tile_files(output: Path, tiling: Tiling) -> dict[Path, Solid]:
    """Return the tiles by their files: the output's name and the number that is engraved in the back.

    Parameters
    ----------
    output : Path
    tiling : Tiling

    Returns
    -------
    dict of Path to Solid
        Empty where the piece is not cut.
    """
    if len(tiling.tiles) == 1:
        return {}
    return {
        output.with_name(f"{output.stem}_{tile.number}{output.suffix}"): tile.solid for tile in tiling.tiles
    }


def write_work(
    output: Path, work: Work, *, height_map: Path | None, taken: Collection[Path] = ()
) -> list[Path]:
    """Write the solid, or the tiles that it is cut into, and the height map.

    Parameters
    ----------
    output : Path
        Of the whole piece; where it is cut, the tiles have this name and their numbers.
    work : Work
    height_map : Path or None
    taken : collection of Path
        Resolved names of files that must not be replaced.

    Returns
    -------
    list of Path
        The files of solids: that of the piece, or those of its tiles.

    Raises
    ------
    FileError
        A file cannot be written, or has the name of one that must stay.
    MeshError
        A solid whose detail the format cannot hold.
    """
    tiles = {} if work.tiling is None else tile_files(output, work.tiling)
    for path in tiles:
        if path.resolve() in taken:
            raise FileError(f"The tile {path} would replace a file that is needed: choose another output.")
    if height_map is not None and work.field is not None:
        write_height_map(height_map, work.field)
    solids = tiles or {output: work.solid}
    write_solids(output, {path.name: solid for path, solid in solids.items()})
    return list(solids)
