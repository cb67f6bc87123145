from dataclasses import replace
from threading import Barrier, Thread

from mvreg.testing import blob_scans
from mvreg.types.lazy import Latest, forget, kept_on_argument, lazy

LATEST = Latest("number")


class Counted:
    times = 0

    @lazy
    def number(self):
        LATEST.add(self)
        self.times += 1
        return self.times


def test_that_the_latest_keep_what_they_have_worked_out(monkeypatch):
    monkeypatch.setattr("mvreg.types.lazy.threads", lambda: 2)
    each = [Counted() for _ in range(3)]
    for one in (*each, each[2], each[1]):
        assert one.number == 1
    assert each[0].number == 2, "it has been forgotten"
    assert (each[2].number, each[1].number) == (1, 2), "that of the second has gone for it"
    del each[1]
    assert each[0].number == 2


def test_that_few_trees_of_large_scans_are_kept(monkeypatch):
    monkeypatch.setattr("mvreg.types.lazy.threads", lambda: 2)
    monkeypatch.setattr("mvreg.types.scan.MANY", 10)
    scans = [replace(scan) for scan in blob_scans(4).scans]  # the kept ones may have trees
    spacings = [scan.spacing for scan in scans]
    assert ["tree" in vars(scan) for scan in scans] == [False, False, True, True]
    assert [scan.spacing for scan in scans] == spacings
    first = scans[0].tree
    assert first is scans[0].tree and first.n == len(scans[0].points)


class Slow:
    def __init__(self, barrier):
        self.barrier = barrier
        self.times = 0

    @lazy
    def answer(self):
        """What it is."""
        self.times += 1
        self.barrier.wait(timeout=10)
        return 42


def test_it_is_worked_out_once():
    one = Slow(Barrier(1))
    assert (one.answer, one.answer, one.times) == (42, 42, 1)
    assert Slow.answer.__doc__ == "What it is."


def test_what_is_forgotten_is_worked_out_again():
    one = Slow(Barrier(1))
    forget(one, "answer")  # nothing is known yet
    assert one.answer == 42
    forget(one, "answer")
    assert (one.answer, one.times) == (42, 2)


def test_instances_do_not_wait_for_each_other():
    barrier = Barrier(2)
    both = [Slow(barrier), Slow(barrier)]
    threads = [Thread(target=lambda one=one: one.answer) for one in both]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert not barrier.broken and [one.times for one in both] == [1, 1]


def test_a_scan_has_one_tree():
    (scan, *_) = blob_scans(2).scans
    assert scan.tree is scan.tree


def test_what_is_kept_on_an_argument_is_worked_out_once_for_each():
    calls = []

    @kept_on_argument
    def points(scan):
        """How many points."""
        calls.append(scan.name)

    first, second, *_ = blob_scans(2).scans
    assert points(first) is points(first) is points(second) is None
    assert calls == [first.name, second.name]
    points(replace(first))
    assert calls == [first.name, second.name, first.name], "a copy begins anew"
    assert points.__doc__ == "How many points."
