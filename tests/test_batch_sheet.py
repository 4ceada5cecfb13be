import numpy as np
from PIL import Image

from o3d_relief.batch_entry import BatchEntry
from o3d_relief.batch_sheet import remove_sheets, write_sheets


def _entries(folder, count):
    (folder / "pictures").mkdir()
    entries = []
    for number in range(count):
        entries.append(
            BatchEntry(input=f"{number}", output=f"r{number}.ply", status="made", seconds=0.0, depth=1.0)
        )
        picture = np.full((20, 20, 3), number % 256, np.uint8)
        Image.fromarray(picture).save(folder / "pictures" / f"r{number}.png")
    return entries


def test_reliefs_in_order_without_gaps(tmp_path):
    entries = _entries(tmp_path, 4)
    entries.insert(2, BatchEntry(input="x", output="x.ply", status="failed", seconds=0.0, error="No."))
    (sheet,) = write_sheets(tmp_path, entries)
    image = np.asarray(Image.open(sheet))
    assert sheet == tmp_path / "contact_sheet.png"
    assert image.shape == (48, 48, 3)
    assert [image[y, x, 0] for y, x in ((5, 5), (5, 40), (40, 5), (40, 40))] == [0, 1, 2, 3]


def test_many_reliefs_have_several_sheets(tmp_path):
    sheets = write_sheets(tmp_path, _entries(tmp_path, 103))
    assert [sheet.name for sheet in sheets] == ["contact_sheet.png", "contact_sheet_2.png"]
    assert np.asarray(Image.open(sheets[0])).shape == (272, 272, 3)
    assert np.asarray(Image.open(sheets[1])).shape == (48, 48, 3)


def test_no_relief_has_no_sheet(tmp_path):
    assert write_sheets(tmp_path, []) == []


def test_old_sheets_are_removed(tmp_path):
    entries = _entries(tmp_path, 103)
    write_sheets(tmp_path, entries)
    (tmp_path / "contact_sheet_of_mine.png").touch()
    assert write_sheets(tmp_path, entries[:2]) == [tmp_path / "contact_sheet.png"]
    assert sorted(path.name for path in tmp_path.glob("*.png")) == [
        "contact_sheet.png",
        "contact_sheet_of_mine.png",
    ]
    write_sheets(tmp_path, entries)
    remove_sheets(tmp_path)
    assert [path.name for path in tmp_path.glob("*.png")] == ["contact_sheet_of_mine.png"]
