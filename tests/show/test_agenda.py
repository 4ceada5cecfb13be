"""What waits, what comes next and what is void, without any editor."""

import threading
import time

import pytest

from o3d_relief.show.agenda import Agenda, Request


def finish(_editor, _continued):
    """Stand for what finishes the relief."""


def request(name, *, delay=0.0, changes=True):
    act = lambda _editor, _continued: name  # noqa: E731
    return Request(name=name, act=act, doing="", due=time.monotonic() + delay, changes=changes)


@pytest.fixture
def agenda():
    return Agenda(finish, rest=0.02, finishing=True)


def finishing(agenda):
    """Take what finishes the relief."""
    agenda.unfinished = True
    taken = agenda.next()
    assert taken.act is finish
    return taken


def test_requests_come_in_their_order_the_newest_of_each_name(agenda):
    first, again = request("beta"), request("beta")
    for one in (first, request("t1"), again, request("t2")):
        agenda.ask(one)
    assert agenda.waiting
    assert [agenda.next().name for _ in range(2)] == ["t1", "beta"]
    assert agenda.next().name == "t2"
    assert not agenda.waiting
    agenda.ask(first)
    agenda.ask(again)
    assert agenda.next() is again


def test_a_request_waits_for_its_time_and_lets_others_pass(agenda):
    slow = request("k", delay=0.1)
    agenda.ask(slow)
    agenda.ask(request("beta"))
    assert agenda.next().name == "beta"
    assert agenda.next() is slow
    assert time.monotonic() >= slow.due


def test_the_relief_is_finished_once_after_a_rest(agenda):
    begin = time.monotonic()
    taken = finishing(agenda)
    assert time.monotonic() - begin >= 0.02
    assert not taken.changes
    assert not agenda.unfinished
    threading.Timer(0.1, agenda.close).start()
    assert agenda.next() is None  # not a second time


def test_requests_come_before_the_relief_is_finished():
    agenda = Agenda(finish, rest=30.0, finishing=True)
    agenda.unfinished = True
    threading.Timer(0.05, agenda.ask, [request("beta")]).start()
    assert agenda.next().name == "beta"
    assert agenda.unfinished


def test_nothing_is_finished_until_it_is_wanted():
    agenda = Agenda(finish, rest=0.0, finishing=False)
    agenda.unfinished = True
    wanted = []

    def want():
        wanted.append(time.monotonic())
        agenda.finish(wanted=True)

    threading.Timer(0.1, want).start()
    assert agenda.next().act is finish
    assert time.monotonic() >= wanted[0]


def test_who_waits_is_told_of_the_end(agenda):
    threading.Timer(0.05, agenda.close).start()
    assert agenda.next() is None
    assert agenda.closed
    assert agenda.called_off
    agenda.ask(request("beta"))
    assert agenda.next() is None


def test_a_change_gives_way_to_a_newer_one_of_its_name_only(agenda):
    agenda.ask(request("k"))
    agenda.next()
    agenda.ask(request("beta"))
    assert not agenda.change_is_void()
    agenda.ask(request("k", delay=60.0))  # also one that waits for the slider to rest
    assert agenda.change_is_void()
    assert not agenda.called_off
    agenda.done()
    assert not agenda.change_is_void()


def test_what_is_called_off_is_void_and_the_next_is_not(agenda):
    agenda.ask(request("k"))
    agenda.next()
    agenda.cancel()
    assert agenda.called_off
    assert agenda.change_is_void()
    assert agenda.relief_is_void()
    assert not agenda.unfinished  # nothing starts by itself
    agenda.ask(request("beta"))
    agenda.next()
    assert not agenda.called_off
    assert not agenda.change_is_void()


def test_finishing_gives_way_to_changes_that_are_due(agenda):
    finishing(agenda)
    assert not agenda.relief_is_void()
    agenda.ask(request("save params", changes=False))
    agenda.ask(request("k", delay=60.0))
    assert not agenda.relief_is_void()
    assert not agenda.unfinished
    agenda.ask(request("beta"))
    assert agenda.relief_is_void()
    assert agenda.unfinished  # after the change


def test_a_relief_that_is_to_be_saved_gives_way_to_nobody(agenda):
    agenda.ask(request("save relief", changes=False))
    agenda.next()
    agenda.ask(request("beta"))
    assert not agenda.relief_is_void()
    agenda.finish(wanted=False)
    assert not agenda.relief_is_void()


def test_finishing_ends_where_it_is_not_wanted_any_more(agenda):
    finishing(agenda)
    agenda.finish(wanted=False)
    assert agenda.called_off
    assert agenda.relief_is_void()
    agenda.finish(wanted=True)
    assert not agenda.called_off
