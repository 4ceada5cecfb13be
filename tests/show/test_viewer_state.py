from dataclasses import replace

import pytest

from o3d_relief.show.viewer_state import OWN, Run, ViewerState, arrived, pressed, shown

RUN = Run(
    names=("scene", "visibility", "attenuation", "construction", "trim"),
    before=(None, None, None, 0, 3),
    meanings=("shade", "visible", "displacement"),
    own=("shade", "visible", "action", "shade", "shade"),
    points=True,
)


def after(keys, state=None, now=10.0, run=RUN):
    state = ViewerState(stage=0) if state is None else state
    for key in keys:
        state = pressed(state, key, now, run)
    return state


@pytest.mark.parametrize(
    ("keys", "stage"),
    [("N", 1), ("NN", 2), ("NNP", 1), ("4", 3), ("5P", 3), ("P", 0), ("5N", 4), ("9", 0), ("0", 0)],
)
def test_jumps(keys, stage):
    assert after(keys).stage == stage


def test_zero_is_the_tenth():
    run = replace(RUN, names=tuple("abcdefghij"), before=(None,) * 10, own=("shade",) * 10)
    assert after("0", run=run).stage == 9


def test_a_jump_too_far_is_told_and_forgotten():
    state = after("9")
    assert state.note == "there are 5 stages so far"
    assert after("N", state).note == ""


def test_colours_go_round_and_do_not_repeat_those_of_the_stage():
    state = after("2")
    seen = []
    for _ in range(3):
        state = after("C", state)
        seen.append(state.meaning)
    assert seen == ["shade", "displacement", OWN]


def test_the_colours_stay_from_stage_to_stage():
    assert after("2CN").meaning == "shade"


def test_switches():
    assert after("O").wireframe
    assert not after("OO").wireframe
    assert after("A").points
    assert not after("AA").points


def test_points_only_where_there_are_some():
    state = after("A", run=replace(RUN, points=False))
    assert not state.points
    assert state.note == "there are no attenuation points"


def test_no_stage_yet():
    assert after("N", ViewerState(), run=Run()) == ViewerState(note="no stage is done yet")


def test_who_looks_at_the_newest_follows():
    assert arrived(ViewerState(stage=3), RUN).stage == 4
    assert arrived(ViewerState(stage=1), RUN).stage == 1
    assert arrived(ViewerState(stage=3, blink_since=0.0), RUN).stage == 3
    assert arrived(ViewerState(), Run(names=("scene",), before=(None,))).stage == 0


def test_blink_changes_between_the_stage_and_the_one_before():
    state = after("5B", now=10.0)
    looks = [shown(state, 10.0 + seconds, RUN)[:3] for seconds in (0.1, 0.6, 1.1, 1.6)]
    assert looks == [(3, 3, 1.0), (4, 4, 1.0), (3, 3, 1.0), (4, 4, 1.0)]
    assert not after("B", state).moving
    assert not after("P", state).moving


def test_nothing_blinks_where_nothing_moved():
    state = after("2B")
    assert not state.moving
    assert state.note == "nothing has moved up to this stage"


def test_morph_goes_from_the_relief_to_the_scene_in_two_seconds():
    state = after("5M", now=10.0)
    shares = []
    for seconds in (0.0, 0.5, 1.0, 1.5):
        start, end, share, state = shown(state, 10.0 + seconds, RUN)
        assert (start, end) == (4, 0)
        shares.append(share)
    assert shares == pytest.approx([0.0, 0.1464466, 0.5, 0.8535534])  # at rest at both ends
    start, end, share, state = shown(state, 12.0, RUN)
    assert (start, end, share) == (0, 0, 1.0)
    assert not state.moving
    assert state.stage == 0


def test_morph_goes_to_the_newest_from_a_stage_that_shows_the_scene():
    assert shown(after("2M"), 10.0, RUN)[:3] == (1, 4, 0.0)


def test_morph_turns_round_on_the_way():
    state = pressed(after("5M", now=10.0), "M", 10.5, RUN)
    start, end, share, _ = shown(state, 10.5, RUN)
    assert (start, end) == (0, 4)
    assert share == pytest.approx(1.0 - 0.1464466)  # from where it was


def test_no_morph_before_there_is_a_relief():
    run = Run(
        names=("scene", "visibility"), before=(None, None), meanings=("shade",), own=("shade", "visible")
    )
    state = after("M", run=run)
    assert not state.moving
    assert state.note == "there is no relief yet"
