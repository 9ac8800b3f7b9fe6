"""Run a function over chunks on several threads. Results do not depend on how many there are.

NumPy and Embree hold no lock during bulk work.
"""

from __future__ import annotations

import os
from collections import deque
from collections.abc import Iterable
from concurrent.futures import ThreadPoolExecutor
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


def map_chunks(
    function: Work[Chunk_contra, Result_co], chunks: Iterable[Chunk_contra], threads: int,
    tick: Tick = unwatched,
) -> list[Result_co]:
    """``[function(chunk) for chunk in chunks]``; ``tick(fraction)`` after each, may raise to stop.

    At most two chunks a thread are in flight, so that stopping is quick.
    """
    chunks = list(chunks)
    count = thread_count(threads)
    if count == 1 or len(chunks) < 2:
        return [_ticked(function(chunk), tick, i, len(chunks)) for i, chunk in enumerate(chunks)]
    results, pending = [], deque()
    with ThreadPoolExecutor(count) as pool:
        try:
            for chunk in chunks:
                pending.append(pool.submit(function, chunk))
                if len(pending) >= 2 * count:
                    results.append(
                        _ticked(pending.popleft().result(), tick, len(results), len(chunks))
                    )
            while pending:
                results.append(
                    _ticked(pending.popleft().result(), tick, len(results), len(chunks))
                )
        finally:
            for future in pending:
                future.cancel()
    return results


def _ticked(result: Result_co, tick: Tick, index: int, total: int) -> Result_co:
    tick((index + 1) / total)
    return result


def ranges(total: int, size: int) -> list[slice]:
    """Slices of at most ``size`` that cover ``range(total)``."""
    return [slice(start, min(start + size, total)) for start in range(0, total, size)]
