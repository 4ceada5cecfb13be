import warnings
from io import BytesIO

import numpy as np
import pytest
from PIL import Image

from o3d_relief.scene.named_files import NamedFiles, to_texture

PIXELS = np.arange(2 * 3 * 3, dtype=np.uint8).reshape(2, 3, 3)


@pytest.fixture
def folder(tmp_path):
    (tmp_path / "parts").mkdir()
    (tmp_path / "parts" / "a.bin").write_bytes(b"inside")
    (tmp_path / "b c.bin").write_bytes(b"beside")
    Image.fromarray(PIXELS).save(tmp_path / "picture.png")
    return tmp_path


@pytest.mark.parametrize(
    ("name", "content"),
    [
        ("parts/a.bin", b"inside"),
        ("parts\\a.bin", b"inside"),
        (' "b c.bin" ', b"beside"),
        ("C:\\of\\somebody\\b c.bin", b"beside"),
        ("/of/somebody/b c.bin", b"beside"),
        ("a.bin", None),
        ("parts", None),
        ("b%20c.bin", None),
        ("b\0c.bin", None),
    ],
)
def test_a_file_is_where_its_name_says_or_beside(folder, name, content):
    assert NamedFiles(folder).read(name) == content


def test_parts_of_a_gltf_are_written_as_addresses(folder):
    named = NamedFiles(folder)
    assert named.get("b%20c.bin") == named["b c.bin"] == b"beside"
    (folder / "b%20c.bin").write_bytes(b"that very name")
    assert named.get("b%20c.bin") == b"that very name"
    with pytest.raises(FileNotFoundError, match=r"d\.bin"):
        named.get("d.bin")


def test_what_is_too_large_for_the_memory_is_not_read(folder, monkeypatch):
    monkeypatch.setattr("o3d_relief.limits.available_memory", lambda: 1)
    assert NamedFiles(folder).read("b c.bin") is None


def test_textures_begin_with_their_bottom_row(folder):
    texture = NamedFiles(folder).texture("picture.png")
    np.testing.assert_array_equal(texture, PIXELS[::-1])
    np.testing.assert_array_equal(to_texture(Image.fromarray(PIXELS).convert("RGBA")), PIXELS[::-1])
    assert NamedFiles(folder).texture("none.png") is None
    assert NamedFiles(folder).texture("b c.bin") is None  # no picture


def test_odd_pictures_warn_nobody():
    odd = Image.new("P", (1, 1))
    odd.putpalette([9, 8, 7])
    stream = BytesIO()
    odd.save(stream, "PNG", transparency=b"\x80")  # Pillow warns of its conversion
    with warnings.catch_warnings(record=True) as told:
        warnings.simplefilter("always")
        assert to_texture(stream).tolist() == [[[9, 8, 7]]]
    assert not told
