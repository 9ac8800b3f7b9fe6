"""Run a function over chunks, on several threads or processes. Results do not depend on how many there are.

NumPy and Embree hold no lock during bulk work, but between two calls of theirs Python does: threads of
one process gain a half, processes (``Helpers``) all that the machine has.
"""

from __future__ import annotations

import os
from collections import deque
from collections.abc import Callable, Iterable
from concurrent.futures import Future, ThreadPoolExecutor
from queue import SimpleQueue
from threading import local
from typing import Protocol, TypeVar

# To be set before NumPy is imported: BLAS's own threads would spin beside the ones here, and the
# rounding of its sums would depend on how many cores a machine has.
BLAS_ENVIRONMENT = {"OPENBLAS_NUM_THREADS": "1"}


Chunk_contra = TypeVar("Chunk_contra", contravariant=True)
Result_co = TypeVar("Result_co", covariant=True)


class Work(Protocol[Chunk_contra, Result_co]):
    """What a worker does with a chunk: any chunk, at any time, on any thread. What it gives follows
    from the chunk alone, so that any number of workers agrees."""

    def __call__(self, chunk: Chunk_contra, /) -> Result_co: ...


class Tick(Protocol):
    """Called with the fraction of the chunks that are done, in [0, 1]; may raise to stop."""

    def __call__(self, fraction: float, /) -> None: ...


def thread_count(threads: int) -> int:
    """``threads``, or the number of cores this process may use when it is 0."""
    if threads:
        return threads
    available = getattr(os, "sched_getaffinity", None)
    return len(available(0)) if available else os.cpu_count() or 1


def unwatched(fraction: float) -> None:
    """A Tick of work that nobody watches."""


class Helpers(Protocol):
    """Processes beside this one that work on chunks."""

    @property
    def rays(self) -> int:
        """Traced by them so far, since they were opened."""

    @property
    def embree_seconds(self) -> float:
        """The same of the seconds spent inside Embree."""

    def hands(self, function: Work[Chunk_contra, Result_co]) -> list[Work[Chunk_contra, Result_co]]:
        """``function``, which can be pickled, as each of them does it: one chunk at a time. A hand whose
        process is lost does its chunks in this one."""


def map_chunks(
    function: Work[Chunk_contra, Result_co], chunks: Iterable[Chunk_contra], threads: int,
    tick: Tick = unwatched, helpers: Helpers | None = None,
) -> list[Result_co]:
    """``[function(chunk) for chunk in chunks]``; ``tick(fraction)`` after each, may raise to stop.

    At most two chunks a thread are in flight, so that stopping is quick. With ``helpers`` one thread
    works here and each of them beside it. What a chunk's work itself spreads is done where it is.
    """
    chunks, count = list(chunks), thread_count(threads)
    if len(chunks) < 2 or getattr(_AT_WORK, "here", False):
        count, helpers = 1, None
    hands = [function] * count if helpers is None else [function, *helpers.hands(function)]
    if len(hands) == 1:
        return [_ticked(function(chunk), tick, i, len(chunks)) for i, chunk in enumerate(chunks)]
    return _by_hands(hands, chunks, tick)


_AT_WORK = local()  # ``here`` is true of a thread that works on a chunk


def _take(pending: deque[Future], results: list[Result_co], tick: Tick, total: int) -> None:
    """Wait for the first that is pending."""
    results.append(_ticked(pending.popleft().result(), tick, len(results), total))


def _by_hands(
    hands: list[Work[Chunk_contra, Result_co]], chunks: list[Chunk_contra], tick: Tick
) -> list[Result_co]:
    """What the ``hands`` make of chunks, in the chunks' order."""
    results: list[Result_co] = []
    pending: deque[Future] = deque()

    with ThreadPoolExecutor(len(hands)) as pool:
        try:
            work = _shared_work(hands)
            for chunk in chunks:
                pending.append(pool.submit(work, chunk))
                if len(pending) >= 2 * len(hands):
                    _take(pending, results, tick, len(chunks))
            while pending:
                _take(pending, results, tick, len(chunks))
        finally:
            for future in pending:
                future.cancel()
    return results


def _shared_work(
    hands: list[Work[Chunk_contra, Result_co]]
) -> Callable[[Chunk_contra], Result_co]:
    """Work on a chunk by the hand that is free."""
    free: SimpleQueue = SimpleQueue()
    for hand in hands:
        free.put(hand)

    def work(chunk: Chunk_contra) -> Result_co:
        hand, _AT_WORK.here = free.get(), True
        try:
            return hand(chunk)
        finally:
            free.put(hand)

    return work


def _ticked(result: Result_co, tick: Tick, index: int, total: int) -> Result_co:
    tick((index + 1) / total)
    return result


def ranges(total: int, size: int) -> list[slice]:
    """Slices of at most ``size`` that cover ``range(total)``."""
    return [slice(start, min(start + size, total)) for start in range(0, total, size)]
