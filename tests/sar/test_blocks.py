"""Interpolated phase factors against all the sines and cosines."""

from contextlib import suppress
from threading import Barrier, BrokenBarrierError, Event, get_ident

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from navfilters.sar.in_parts import blocks, in_threads
from navfilters.sar.phase_blocks import PIECE, lines_at_once, phasor, unit


def quadratic(rate):
    """A phase that changes by so many radians a line at its steepest: (frequencies, places)."""
    f, x = np.linspace(-500.0, 500.0, 1000), np.linspace(-1.0, 1.0, 3 * PIECE)
    return f, x, lambda f, x: rate * 500 * x * (f / 500) ** 2


@pytest.mark.parametrize("rate", [0.0, 1e-4, 0.03, 0.4, 5.0])
def test_a_block_is_short_enough(rate):
    """To 5e-5 rad, and blocks four times as long are not: the rule is needed."""
    f, x, phase = quadratic(rate)
    most = lines_at_once(f, (phase, x))
    wanted = np.exp(1j * phase(f[:, None], x))
    error = [
        max(np.abs(phasor(phase, f[b], x) - wanted[b]).max() for b in blocks(len(f), n))
        for n in (most, 4 * most)
    ]
    assert error[0] < 5e-5
    assert rate < 0.01 or error[1] > 1e-3


@pytest.mark.parametrize(("lines", "most"), [(3, 1), (80, 10), (100_000, 512)])
def test_level_phases_have_blocks_of_limited_length(lines, most):
    f, x, phase = quadratic(0.0)
    assert lines_at_once(np.linspace(f[0], f[-1], lines), (phase, x)) == most


def test_large_phases_are_reduced_before_they_are_rounded():
    phase = np.array([1e6, -123456.789, 0.0])
    assert_allclose(unit(phase), np.exp(1j * phase), atol=2e-7)
    assert unit(phase).dtype == np.complex64


def test_blocks_make_up_all_lines():
    assert blocks(7, 3) == [slice(0, 3), slice(3, 6), slice(6, 7)]
    done = np.zeros(1000, int)

    def work(lines):
        done[lines] += 1

    in_threads(work, blocks(1000, 7))
    assert_array_equal(done, 1)


@pytest.mark.parametrize("threads", ["1", "2"])
def test_results_come_in_the_order_of_the_parts(monkeypatch, threads):
    monkeypatch.setenv("OPENBLAS_NUM_THREADS", threads)
    assert in_threads(lambda k: k * k, range(50)) == [k * k for k in range(50)]


def threads_at_work(patience):
    """Those that share two parts, each of which waits for another thread to take the other."""
    both = Barrier(2)

    def met(_):
        with suppress(BrokenBarrierError):  # one thread does one after the other
            both.wait(patience)
        return get_ident()

    return set(in_threads(met, range(2)))


@pytest.mark.parametrize("slow", [0, 1])
def test_two_threads_at_most_are_at_work(monkeypatch, slow):
    """Parts of a part have the second thread when it has nothing left to do, and not before."""
    monkeypatch.delenv("OPENBLAS_NUM_THREADS", raising=False)
    both, ended = Barrier(2, timeout=60), Event()

    def work(part):
        both.wait()
        if part != slow:
            alone = threads_at_work(0.05)
            ended.set()
            return alone
        assert ended.wait(timeout=60)
        for _ in range(100):  # the other thread is about to end
            if len(found := threads_at_work(0.05)) == 2:
                break
        return found

    found = in_threads(work, range(2))
    assert [len(threads) for threads in found] == ([2, 1] if slow == 0 else [1, 2])
    assert len(threads_at_work(60)) == 2


def test_errors_leave_the_threads():
    def work(lines):
        raise ZeroDivisionError("in a thread")

    with pytest.raises(ZeroDivisionError, match="in a thread"):
        in_threads(work, blocks(10, 2))


def test_an_error_gives_the_second_thread_back(monkeypatch):
    monkeypatch.delenv("OPENBLAS_NUM_THREADS", raising=False)
    test_errors_leave_the_threads()
    assert len(threads_at_work(60)) == 2


def test_after_an_error_nothing_more_is_begun(monkeypatch):
    monkeypatch.delenv("OPENBLAS_NUM_THREADS", raising=False)
    begun = []

    def work(part):
        begun.append(part)
        raise ZeroDivisionError

    with pytest.raises(ZeroDivisionError):
        in_threads(work, range(100))
    assert len(begun) <= 2
