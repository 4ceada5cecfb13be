import importlib
import subprocess
import sys

import pytest

import o3d_relief


@pytest.mark.parametrize("name", o3d_relief.__all__)
def test_every_public_name_exists_and_is_documented(name):
    assert getattr(o3d_relief, name).__doc__


def test_unknown_name_is_an_attribute_error():
    with pytest.raises(AttributeError, match="no attribute 'bas_relief'"):
        o3d_relief.bas_relief  # noqa: B018


def test_names_are_listed():
    assert set(o3d_relief.__all__) <= set(dir(o3d_relief))


def test_import_does_not_load_open3d():
    code = "import sys, o3d_relief; sys.exit('open3d' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0


def test_homes_are_the_modules_that_define_the_names():
    for name, home in o3d_relief._HOME.items():
        assert name in importlib.import_module(f"o3d_relief.{home}").__all__
