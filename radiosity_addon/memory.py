"""Memory: how much this process used at most, and how much it may still take."""

from __future__ import annotations

import ctypes
import os
import sys
from collections.abc import Callable
from pathlib import Path

# Memory [bytes of address space], at the start and for each core, as measured.
START, START_PER_CORE = 1700 << 20, 100 << 20
# Memory [bytes] of a bake, and of each of its receivers and triangles, measured.
ALWAYS, PER_RECEIVER, PER_TRIANGLE = 450e6, 2900.0, 1200.0
# Numbers [texels that belong to a face]: more than UNDIVIDED are baked in tiles of at most TILE, after a
# survey of SURVEY coarse ones. The first two set the memory; the smaller they are the more is done twice,
# where tiles overlap.
UNDIVIDED, TILE, SURVEY = 1_500_000, 700_000, 400_000
OVERLAPS = 1.1  # factor [texels of a tile], with those that others have, too
SURVEYED = 600.0  # memory [bytes of each texel of the survey] that stays
# Memory [bytes of each texel] that is done, and of the largest image's, measured.
KEPT, DRAWN = 8.0, 60.0
ROUND = 16  # edge [texels]: edges that are suggested for images are multiples of it


def peak_memory() -> int:
    """The largest resident size of this process so far [bytes]; 0 where it cannot be read.

    On Linux the kernel's own high-water mark: getrusage also counts what the parent process had
    when it started this one.
    """
    if sys.platform == "win32":
        return _windows_peak()
    kilobytes = _proc_value("/proc/self/status", "VmHWM:")
    if kilobytes is not None:
        return kilobytes * 1024
    import resource

    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    return peak if sys.platform == "darwin" else peak * 1024


def available_memory() -> int | None:
    """Bytes this process may still take: free memory and its own limit; None where unknown."""
    if sys.platform == "win32":
        return _windows_available()
    known = [size for size in (_free_memory(), _address_space_left()) if size is not None]
    return min(known) if known else None


def of_a_bake(receivers: float, triangles: float) -> float:
    """Bytes that a bake takes, about, beside the ALWAYS of Blender and the libraries themselves.

    ``receivers`` are the texels, or the pieces of faces that get light for vertex colors.
    docs/stability.md compares it with what was measured.
    """
    return PER_RECEIVER * receivers + PER_TRIANGLE * triangles


def of_images(texels: float, largest: float, triangles: float) -> float:
    """The same for images of so many ``texels`` together, of which the ``largest`` has that many."""
    undivided = of_a_bake(min(texels, UNDIVIDED), triangles)
    if texels <= UNDIVIDED:
        return undivided
    tile = of_a_bake(OVERLAPS * TILE, triangles) + SURVEYED * SURVEY
    return max(undivided, tile + KEPT * texels + DRAWN * largest)


def fitting_share(free: float, needed: Callable[[float], float]) -> float:
    """The largest share in [0, 1] whose ``needed(share)`` bytes, which grow with it, are ``free``;
    0 where none is."""
    low, high = 0.0, 1.0
    if needed(high) <= free:
        return high
    for _ in range(40):
        middle = (low + high) / 2
        low, high = (middle, high) if needed(middle) <= free else (low, middle)
    return low


def fitting_edge(edge: int, free: float, texels: float, largest: float, triangles: float) -> int:
    """To what the ``edge`` of images of so many ``texels``, the ``largest`` of that many, must be
    lowered for them to fit into ``free`` bytes; 0 where none fits."""
    share = fitting_share(free, lambda s: of_images(s * texels, s * largest, triangles))
    return edge if share == 1 else int(edge * share**0.5) // ROUND * ROUND


def require(needed: int, what: str, remedy: str) -> None:
    """Raise MemoryError naming ``what`` and the ``remedy`` when ``needed`` bytes are not there."""
    left = available_memory()
    if left is not None and needed > left:
        raise MemoryError(
            f"{what} needs about {_gigabytes(needed)} of memory and {_gigabytes(left)} are free; "
            f"{remedy}"
        )


def require_start() -> None:
    """Raise MemoryError where Blender and the libraries could not even be loaded: they crash then.

    They map 1.5 GB of addresses, and more for each thread, before any work is done.
    """
    left = None if sys.platform == "win32" else _address_space_left()
    needed = START + START_PER_CORE * (os.cpu_count() or 1)
    if left is not None and needed > left:
        raise MemoryError(
            f"Blender needs {_gigabytes(needed)} of address space to start and this process is "
            f"limited to {_gigabytes(left)}; raise the limit (ulimit -v)"
        )


def _gigabytes(size: int) -> str:
    return f"{size / 2**30:.1f} GB"


def _free_memory() -> int | None:
    """MemAvailable on Linux; a quarter of all memory where only the total is known (macOS)."""
    kilobytes = _proc_value("/proc/meminfo", "MemAvailable:")
    if kilobytes is not None:
        return kilobytes * 1024
    try:
        return os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE") // 4
    except (ValueError, OSError, AttributeError):
        return None


def _proc_value(path: str, key: str) -> int | None:
    """The number after ``key`` in one of Linux' tables; None on other systems."""
    try:
        lines = Path(path).read_text().splitlines()
    except OSError:
        return None
    return next((int(line.split()[1]) for line in lines if line.startswith(key)), None)


def _address_space_left() -> int | None:
    """What ``ulimit -v`` leaves, or None without such a limit."""
    import resource

    limit = resource.getrlimit(resource.RLIMIT_AS)[0]
    if limit == resource.RLIM_INFINITY:
        return None
    try:
        used = int(Path("/proc/self/statm").read_text().split()[0]) * os.sysconf("SC_PAGE_SIZE")
    except OSError:
        used = peak_memory()
    return max(0, limit - used)


class _MemoryCounters(ctypes.Structure):
    """PROCESS_MEMORY_COUNTERS of the Windows API; sizes in bytes."""

    _fields_ = [
        ("cb", ctypes.c_ulong),
        ("page_faults", ctypes.c_ulong),
        ("peak_working_set", ctypes.c_size_t),
        ("working_set", ctypes.c_size_t),
        ("pools", ctypes.c_size_t * 4),
        ("pagefile", ctypes.c_size_t * 2),
    ]


class _MemoryStatus(ctypes.Structure):
    """MEMORYSTATUSEX of the Windows API; sizes in bytes."""

    _fields_ = [
        ("length", ctypes.c_ulong),
        ("load", ctypes.c_ulong),
        ("total", ctypes.c_ulonglong),
        ("available", ctypes.c_ulonglong),
        ("others", ctypes.c_ulonglong * 5),
    ]


def _windows_peak() -> int:
    counters = _MemoryCounters(cb=ctypes.sizeof(_MemoryCounters))
    kernel = ctypes.windll.kernel32
    kernel.GetCurrentProcess.restype = ctypes.c_void_p
    read = kernel.K32GetProcessMemoryInfo
    read.argtypes = (ctypes.c_void_p, ctypes.c_void_p, ctypes.c_ulong)
    ok = read(kernel.GetCurrentProcess(), ctypes.byref(counters), counters.cb)
    return counters.peak_working_set if ok else 0


def _windows_available() -> int | None:
    status = _MemoryStatus(length=ctypes.sizeof(_MemoryStatus))
    ok = ctypes.windll.kernel32.GlobalMemoryStatusEx(ctypes.byref(status))
    return status.available if ok else None
