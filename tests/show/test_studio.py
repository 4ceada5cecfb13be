"""The editor's other thread, without any window."""

import time

import numpy as np
import pytest

from o3d_relief.editor import ReliefEditor
from o3d_relief.params import ReliefParams, View
from o3d_relief.params_file import load_params
from o3d_relief.pipeline import make_relief
from o3d_relief.records import final_heights
from o3d_relief.scene.read import read_mesh
from o3d_relief.show.studio import Studio
from shapes import bust, to_mesh

PARAMS = ReliefParams(k=10, in_order=False)


class Gallery:
    """Keeps all that a studio has told."""

    def __init__(self, params=PARAMS, **options):
        self.mesh = to_mesh(bust(24))
        self.told = []
        self.studio = None
        self.studio = Studio(self.mesh, params, View(), self._note, **{"rest": 0.2, **options})

    def _note(self):
        if self.studio is not None:
            self.told.append((self.studio.sight, self.studio.work))

    def wait(self, what, seconds=60.0):
        """Wait until something holds of the studio."""
        end = time.monotonic() + seconds
        while time.monotonic() < end:
            if what(self.studio):
                return self.studio
            time.sleep(0.01)
        raise AssertionError(f"it did not happen: {self.studio.work}")


@pytest.fixture
def gallery(request):
    gallery = Gallery(**getattr(request, "param", {}))
    yield gallery
    gallery.studio.close()


def rested(studio):
    return studio.sight is not None and studio.sight.final and not studio.waiting and not studio.work.doing


def test_first_a_preview_then_the_relief(gallery):
    studio = gallery.wait(rested)
    relief = make_relief(gallery.mesh, PARAMS)
    np.testing.assert_array_equal(studio.sight.vertices[:, 2], final_heights(relief.stages))
    first = next(sight for sight, _ in gallery.told if sight is not None)
    assert not first.final
    assert first.version < studio.sight.version
    stages = {work.doing for _, work in gallery.told}
    assert {"construction", "restoration", "trim"} <= stages


def test_a_change_shows_and_is_finished_later(gallery):
    gallery.wait(rested)
    gallery.studio.change("beta", beta=0.05)
    studio = gallery.wait(lambda studio: studio.sight.params.beta == 0.05)
    assert not studio.sight.final
    preview = ReliefEditor(gallery.mesh, ReliefParams(k=10, in_order=False, beta=0.05))
    np.testing.assert_allclose(studio.sight.vertices * studio.sight.unit, preview.vertices, atol=1e-9)
    gallery.wait(rested)
    assert gallery.studio.sight.params.beta == 0.05


def test_a_dragged_slider_is_one_step_of_undo(gallery):
    gallery.wait(rested)
    for value in (0.1, 0.15, 0.3):
        gallery.studio.change("beta", beta=value)
        gallery.wait(lambda studio, value=value: studio.sight.params.beta == value)
    gallery.studio.change("t1", discard_above=0.9)
    gallery.wait(lambda studio: studio.sight.params.discard_above == 0.9)
    gallery.studio.undo()
    gallery.studio.undo()
    gallery.wait(lambda studio: studio.sight.params == PARAMS)
    gallery.studio.redo()
    gallery.wait(lambda studio: studio.sight.params.beta == 0.3)


@pytest.mark.parametrize("gallery", [{"finishing": False}], indirect=True)
def test_of_values_that_wait_the_last_counts(gallery):
    gallery.wait(lambda studio: studio.sight is not None)
    for k in (11, 12, 13):
        gallery.studio.change("k", slow=True, k=k)  # waits until the slider rests
    gallery.wait(lambda studio: studio.sight.params.k == 13)
    assert {sight.params.k for sight, _ in gallery.told if sight is not None} == {10, 13}
    assert any(work.doing == "the responses of the surface" for _, work in gallery.told)


def test_what_fails_is_told_and_the_last_good_state_stays(gallery):
    gallery.wait(rested)
    before = gallery.studio.sight
    gallery.studio.change("t1", discard_above=0.1)
    gallery.wait(lambda studio: studio.work.sentence)
    assert gallery.studio.work.sentence.startswith("attach_below must not exceed discard_above")
    assert gallery.studio.sight is before
    gallery.studio.change("t1", discard_above=0.5)
    gallery.wait(lambda studio: studio.sight.params.discard_above == 0.5)
    assert not gallery.studio.work.sentence


def test_points_are_edited_and_parameters_replayed(gallery, tmp_path):
    gallery.wait(rested)
    gallery.studio.ask("edit", lambda editor, _: editor.edit([1, 4], action="discard"))
    gallery.wait(lambda studio: studio.sight.points.edited.sum() == 2)
    gallery.wait(rested)
    gallery.studio.save_params(tmp_path / "params.json")
    gallery.studio.save_relief(tmp_path / "relief.ply")
    gallery.wait(lambda studio: "relief.ply" in studio.work.sentence)
    params, view = load_params(tmp_path / "params.json")
    assert (params, view) == (gallery.studio.sight.params, gallery.studio.sight.view)
    again = make_relief(gallery.mesh, params, view=view)
    np.testing.assert_array_equal(
        np.asarray(read_mesh(tmp_path / "relief.ply").vertices), np.asarray(again.mesh.vertices)
    )


def test_a_file_that_cannot_be_written_is_told(gallery, tmp_path):
    gallery.wait(rested)
    gallery.studio.save_params(tmp_path / "missing" / "params.json")
    gallery.wait(lambda studio: "is missing" in studio.work.sentence)
    assert gallery.studio.sight.final
    assert gallery.studio.work.wrong
    gallery.studio.save_params(tmp_path / "params.json")
    gallery.wait(lambda studio: studio.work.sentence.startswith("saved"))
    assert not gallery.studio.work.wrong


@pytest.mark.parametrize("gallery", [{"params": ReliefParams(k=10)}], indirect=True)
def test_cancelled_the_preview_stays(gallery):
    gallery.wait(lambda studio: studio.work.doing == "order")
    gallery.studio.cancel()
    gallery.wait(lambda studio: studio.work.sentence == "called off")
    time.sleep(0.5)
    assert not gallery.studio.sight.final  # and nothing starts by itself
    assert not gallery.studio.work.doing
    gallery.studio.change("beta", beta=0.1)
    gallery.wait(lambda studio: studio.work.doing == "order")


def _slow_change(gallery, monkeypatch, then):
    """Ask for another k; do something as soon as its responses are computed."""
    gallery.wait(rested)
    note = gallery._note

    def watched():
        note()
        if gallery.studio.work.doing == "responses" and not gallery.studio.waiting:
            then()

    monkeypatch.setattr(gallery.studio, "_on_news", watched)
    gallery.studio.change("k", slow=True, k=11)


def test_a_slow_change_is_called_off(gallery, monkeypatch):
    _slow_change(gallery, monkeypatch, gallery.studio.cancel)
    gallery.wait(lambda studio: studio.work.sentence == "called off")
    assert gallery.studio.sight.params.k == 10
    assert not gallery.studio.work.wrong


def test_a_slow_change_gives_way_to_the_next_of_its_kind(gallery, monkeypatch):
    again = []

    def then():
        if not again:
            again.append(True)
            gallery.studio.change("k", slow=True, k=12)

    _slow_change(gallery, monkeypatch, then)
    gallery.wait(lambda studio: studio.sight.params.k == 12)
    assert {sight.params.k for sight, _ in gallery.told if sight is not None} == {10, 12}
    assert not gallery.studio.work.sentence
    gallery.studio.undo()
    gallery.wait(lambda studio: studio.sight.params.k == 10)


@pytest.mark.parametrize("gallery", [{"params": ReliefParams(k=10), "finishing": False}], indirect=True)
@pytest.mark.parametrize("then", ["change", "cancel", "close"])
def test_what_happens_while_a_relief_is_saved(gallery, monkeypatch, tmp_path, then):
    gallery.wait(lambda studio: studio.sight is not None)
    asked, stop = [], gallery.studio.cancel if then == "cancel" else None

    def watched():
        if gallery.studio.work.doing == "order" and not asked:
            asked.append(True)
            if then == "change":
                gallery.studio.change("beta", beta=0.1)
            elif stop is not None:
                stop()

    monkeypatch.setattr(gallery.studio, "_on_news", watched)
    gallery.studio.save_relief(tmp_path / "relief.ply")
    if then == "close":
        gallery.wait(lambda studio: studio.work.doing == "order")
        gallery.studio.close()
    elif then == "cancel":
        gallery.wait(lambda studio: studio.work.sentence == "called off")
    else:  # the save goes on, and the change comes after it
        gallery.wait(lambda studio: studio.sight.params.beta == 0.1)
    assert (tmp_path / "relief.ply").exists() == (then == "change")


def test_a_slow_change_goes_on_where_nothing_is_to_be_finished(gallery, monkeypatch):
    _slow_change(gallery, monkeypatch, lambda: gallery.studio.finish(wanted=False))
    gallery.wait(lambda studio: studio.sight.params.k == 11)


@pytest.mark.parametrize("gallery", [{"params": ReliefParams(k=10)}], indirect=True)
def test_a_change_calls_off_the_relief_before(gallery):
    gallery.wait(lambda studio: studio.work.doing == "order")
    gallery.studio.change("beta", beta=0.1)
    gallery.wait(lambda studio: studio.sight.params.beta == 0.1)
    assert not any(sight.final for sight, _ in gallery.told if sight is not None)


def test_without_finishing_only_previews(gallery):
    gallery.wait(rested)
    gallery.studio.finish(wanted=False)
    gallery.wait(lambda studio: not studio.sight.final)
    time.sleep(0.5)
    assert not gallery.studio.sight.final
    gallery.studio.finish(wanted=True)
    gallery.wait(rested)


def test_closed_in_mid_computation():
    gallery = Gallery(params=ReliefParams(k=10))
    gallery.wait(lambda studio: studio.work.doing == "order")
    params, view = gallery.studio.close()
    assert (params, view) == (ReliefParams(k=10), View())
    told = len(gallery.told)
    time.sleep(0.3)
    assert len(gallery.told) == told  # nobody is told any more


def test_what_cannot_be_opened_is_told():
    gallery = Gallery(params=ReliefParams(k=100_000))
    gallery.wait(lambda studio: studio.work.failed)
    assert "k must be at most the number of vertices" in gallery.studio.work.sentence
    assert gallery.studio.close() is None
