from dataclasses import replace
from threading import Barrier, Thread

from mvreg.testing import blob_scans
from mvreg.types.lazy import forget, kept_on_argument, lazy


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
