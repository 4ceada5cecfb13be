import dataclasses

import numpy as np
import pytest

import o3d_relief as rel
from o3d_relief.batch_recipe import Recipe

RECIPE = Recipe(
    params=rel.ReliefParams(k=4, in_order=False),
    view=rel.View(),
    scan=rel.ScanParams(),
    ending=".ply",
    max_triangles=None,
)


@pytest.mark.parametrize("name", ["strict", "certificates"])
def test_the_same_reliefs_with_or_without(name):
    assert dataclasses.replace(RECIPE, **{name: True}).digest() == RECIPE.digest()
    with pytest.raises(rel.ParameterError, match=f"{name} must be True or False. Got 'no' instead"):
        dataclasses.replace(RECIPE, **{name: "no"})


@pytest.mark.parametrize(
    "change",
    [
        {"params": rel.ReliefParams(k=5, in_order=False)},
        {"view": rel.View(front="x")},
        {"scan": rel.ScanParams(max_hole=9.0)},
        {"ending": ".obj"},
        {"max_triangles": 10},
    ],
)
def test_every_part_of_the_recipe_counts(change):
    assert dataclasses.replace(RECIPE, **change).digest() != RECIPE.digest()
    assert dataclasses.replace(RECIPE).digest() == RECIPE.digest()


def test_a_recipe_is_checked_before_any_work():
    assert dataclasses.replace(RECIPE, max_triangles=np.int64(7)) == dataclasses.replace(
        RECIPE, max_triangles=7
    )
    assert dataclasses.replace(RECIPE, max_triangles=np.int64(7)).digest() != RECIPE.digest()
    for name, value in {"max_triangles": 0, "params": {}, "view": "z", "scan": 3, "strict": 1}.items():
        with pytest.raises(rel.ParameterError, match=f"{name} must be"):
            dataclasses.replace(RECIPE, **{name: value})
