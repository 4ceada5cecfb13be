import pytest

from o3d_relief.history import History


class Document:
    """What a user changes: it keeps its old states in a history."""

    def __init__(self):
        self.state = "a"
        self.history = History()

    def change(self, state, *, continued=False):
        self.history.keep(self.state, continued=continued)
        self.state = state

    def go(self, state):
        self.state = state

    def undo(self):
        return self.history.undo(self.state, self.go)

    def redo(self):
        return self.history.redo(self.state, self.go)


@pytest.fixture
def document():
    document = Document()
    for state in "bcd":
        document.change(state)
    return document


def test_back_to_the_beginning_and_forth_to_the_end(document):
    seen = []
    while document.undo():
        seen.append(document.state)
    assert seen == ["c", "b", "a"]
    seen.clear()
    while document.redo():
        seen.append(document.state)
    assert seen == ["b", "c", "d"]
    assert document.undo()
    assert document.state == "c"


def test_nothing_to_undo_or_redo_leaves_the_state_alone():
    document = Document()
    assert not document.undo()
    assert not document.redo()
    assert document.state == "a"


def test_a_change_after_an_undo_drops_what_was_undone(document):
    document.undo()
    document.change("x")
    assert not document.redo()
    assert document.state == "x"
    document.undo()
    assert document.state == "c"


def test_changes_that_go_on_are_undone_together(document):
    for state in "efg":
        document.change(state, continued=state != "e")
    document.undo()
    assert document.state == "d"
    document.redo()
    assert document.state == "g"


def test_the_first_change_is_kept_though_it_is_said_to_go_on():
    document = Document()
    document.change("b", continued=True)
    assert document.undo()
    assert document.state == "a"


def test_a_state_that_cannot_be_gone_to_changes_nothing(document):
    def refuse(state):
        raise ValueError(state)

    with pytest.raises(ValueError, match="c"):
        document.history.undo(document.state, refuse)
    assert not document.redo()
    assert document.undo()
    assert document.state == "c"
    with pytest.raises(ValueError, match="d"):
        document.history.redo(document.state, refuse)
    assert document.redo()
    assert document.state == "d"
