"""The cases of the fuzz tests: damaged files, meshes and point clouds, with parameters of every size."""

from __future__ import annotations

from functools import lru_cache
from typing import Any

from hypothesis import strategies as st

from fuzz_clouds import CLOUDS, cloud_defects, damaged_cloud, scans
from fuzz_files import SAMPLES, Files, edited, edits
from fuzz_meshes import SHAPES, damaged, defects
from fuzz_worker import Case

_one_of = st.sampled_from
_usually = {
    "k": _one_of([1, 2, 8, 24]),
    "seed": _one_of([0, 7]),
    "in_order": _one_of([True, True, False]),
    "in_front": _one_of([True, True, False]),
    "smooth_points": _one_of([True, True, False]),
}
_sometimes = {
    "beta": _one_of([0.0, 1e-9, 3.0, 1e9]),
    "blend": _one_of([0.0, 1.0]),
    "discard_above": _one_of([0.3, 0.31, 1.0]),
    "attach_below": _one_of([0.0, 0.25]),
    "max_order_error": _one_of([0.0, 1.0]),
    "alpha": _one_of([1e-6, 0.5, 1.0]),
}
_depth = st.fixed_dictionaries(
    {
        "depth": _one_of([1e-9, 0.01, 1.0, 1e9]),
        "min_gap": _one_of([0.0, 1e-9, 3.0, 1e12]),
        "in_order": st.just(True),
    }
)
params = st.one_of(
    st.fixed_dictionaries(_usually),
    st.fixed_dictionaries(_usually, optional=_sometimes),
    st.tuples(st.fixed_dictionaries(_usually), _depth).map(lambda pair: pair[0] | pair[1]),
)
_plain = st.just({})
views = st.one_of(
    _plain,
    _plain,
    st.fixed_dictionaries(
        {},
        optional={
            "front": _one_of(["z", "-z", "x", (1.0, 0.2, 1e-3)]),
            "viewpoint": _one_of([(0.0, 0.0, 150.0), (40.0, -1e3, 400.0), (0.0, 0.0, 1e300)]),
            "vanishing_point": _one_of([(0.0, 0.0, -80.0), (1e6, 0.0, -0.02), (0.0, 0.0, -1e300)]),
        },
    ),
)  # fmt: skip
outputs = _one_of([".ply", ".obj", ".stl", ".glb"])


@lru_cache
def _sample(name: str) -> Files:
    return (SAMPLES | CLOUDS)[name]()


@st.composite
def file_cases(draw: st.DrawFn) -> Case:
    """Files with a few edits."""
    name, changes = draw(_one_of([*SAMPLES, *CLOUDS])), draw(edits)
    files = _sample(name)
    for change in changes:
        files = edited(files, change)
    chosen: dict[str, Any] = {"k": 4, "in_order": draw(_one_of([True, False]))}
    return Case(name=f"{name} {changes}", files=files, params=chosen, output=draw(outputs))


@st.composite
def mesh_cases(draw: st.DrawFn) -> Case:
    """Meshes with a few defects."""
    name, chosen = draw(_one_of(list(SHAPES))), draw(defects)
    asked, view, output = draw(params), draw(views), draw(outputs)
    return Case(
        name=f"{name} {chosen} {asked} {view} {output}",
        arrays=damaged(name, *chosen),
        params=asked,
        view=view,
        output=output,
        picture=draw(st.sampled_from([True] + 9 * [False])),
    )


@st.composite
def cloud_cases(draw: st.DrawFn) -> Case:
    """Point clouds with a few defects."""
    chosen, scan, view = draw(cloud_defects), draw(scans), draw(views)
    return Case(
        name=f"cloud {chosen} {scan} {view}",
        arrays=damaged_cloud(*chosen),
        params={"k": 4, "in_order": False},
        view=view,
        scan=scan,
        output=draw(outputs),
    )
