import io
import json
import struct

import numpy as np
import pytest
from PIL import Image

from o3d_relief.errors import FileError
from o3d_relief.solid.heightmap import check_height_map, encode_height_map, height_map_scale, write_height_map
from o3d_relief.solid.heights import HeightField, height_field
from slabs import ball_on_slab


@pytest.fixture
def field():
    z = np.linspace(0.0, 20.0, 40 * 60).reshape(40, 60)
    z[0, :5] = np.nan
    return HeightField(
        z=z,
        is_plate=np.zeros(z.shape, dtype=bool),
        mm_per_pixel=0.3,
        left=-9.0,
        top=6.0,
        back=-4.0,
        highest=20.0,
    )


def _read(path):
    """Read pixels and scale back as another program would."""
    with Image.open(path) as picture:
        assert picture.mode == "I;16"
        if path.suffix == ".png":
            scale = {name: float(text) for name, text in picture.text.items() if name != "Software"}
        else:
            scale = json.loads(picture.tag_v2[270])
        return np.asarray(picture), scale


@pytest.mark.parametrize("ending", ["png", "tif", "TIFF"])
def test_heights_come_back_from_the_file(tmp_path, field, ending):
    path = tmp_path / f"map.{ending}"
    write_height_map(path, field)
    grey, scale = _read(path)
    assert scale == height_map_scale(field)
    assert scale["mm_per_pixel"] == 0.3
    assert scale["mm_per_grey_level"] == pytest.approx(24.0 / 65535)
    heights = grey * scale["mm_per_grey_level"] + scale["z_of_black_mm"]
    inside = field.inside
    assert np.abs(heights - field.z)[inside].max() <= 0.5001 * scale["mm_per_grey_level"]
    assert (grey[~inside] == 0).all()
    assert grey.max() == 65535


def test_png_says_its_resolution(field):
    data = encode_height_map(field, tiff=False)
    place = data.index(b"pHYs") + 4
    assert struct.unpack(">IIB", data[place : place + 9]) == (3333, 3333, 1)  # per metre
    assert data[24:26] == bytes([16, 0])  # bit depth, grey


def test_tiff_says_its_resolution(field):
    with Image.open(io.BytesIO(encode_height_map(field, tiff=True))) as picture:
        tags = picture.tag_v2
        assert float(tags[282]) == float(tags[283]) == pytest.approx(10.0 / 0.3)
        assert tags[296] == 3  # per centimetre
        assert tags[258] == (16,)


def test_first_row_is_the_top_of_the_piece(tmp_path):
    path = tmp_path / "map.png"
    write_height_map(path, height_field(ball_on_slab(), 0.5))
    grey, _ = _read(path)
    row, column = np.unravel_index(np.argmax(grey), grey.shape)
    # The ball's centre, (3, 2), on a plate from -30 to 30 and from -20 to 20.
    assert abs((column + 0.5) * 0.5 - 33.0) < 1.5
    assert abs((row + 0.5) * 0.5 - 18.0) < 1.5


@pytest.mark.parametrize("tiff", [False, True])
def test_the_same_field_gives_the_same_bytes(field, tiff):
    assert encode_height_map(field, tiff=tiff) == encode_height_map(field, tiff=tiff)


def test_other_endings_are_refused():
    with pytest.raises(FileError, match=r"must be one of \.png, \.tif, \.tiff"):
        check_height_map("map.jpg")
