"""The terminal: a progress line, the final words, and nothing of Blender's own chatter. No bpy.

Blender and Cycles print from C, so the file descriptors themselves are pointed elsewhere while a
bake runs. Set RADIOSITY_DEBUG=1 to see everything they print, and tracebacks.
"""

from __future__ import annotations

import ctypes
import os
import shutil
import sys
import time
from contextlib import ExitStack, redirect_stderr, redirect_stdout

REDRAW = 0.1  # time [s] between two progress lines


def debugging() -> bool:
    """Whether the user asked for Blender's messages and for tracebacks."""
    return bool(os.environ.get("RADIOSITY_DEBUG"))


class Terminal:
    """Standard output and error as they were, while descriptors 1 and 2 lead nowhere.

    ``progress(phase, fraction)`` draws one line on a terminal and nothing elsewhere.
    """

    def __init__(self) -> None:
        self._saved: list[tuple[int, int]] = []  # (descriptor, its copy)
        self._python = ExitStack()  # Python's own streams, put back at the end
        self._drawn = False
        self._next = 0.0
        self._start = time.monotonic()

    def __enter__(self) -> Terminal:
        _flush()
        self._saved = [(number, _copy(number)) for number in (1, 2)]
        self._shows_progress = self._saved[1][1] >= 0 and os.isatty(self._saved[1][1])
        if not debugging():
            self._silence()
        return self

    def __exit__(self, *_) -> None:
        self.clear()
        _flush()
        self._python.close()
        for number, copy in self._saved:
            if copy >= 0:
                os.dup2(copy, number)
                os.close(copy)
        self._saved = []

    def _silence(self) -> None:
        nowhere = self._python.enter_context(open(os.devnull, "w"))
        self._python.enter_context(redirect_stdout(nowhere))
        self._python.enter_context(redirect_stderr(nowhere))
        for number, copy in self._saved:
            if copy >= 0:
                os.dup2(nowhere.fileno(), number)

    def progress(self, phase: str, fraction: float) -> None:
        """Redraw the line ``phase percent, time left`` unless that was done just before."""
        now = time.monotonic()
        if not self._shows_progress or now < self._next:
            return
        self._next = now + REDRAW
        line = progress_line(phase, fraction, now - self._start)
        width = shutil.get_terminal_size().columns - 1
        self._write(2, "\r" + line[:width].ljust(width))
        self._drawn = True

    def clear(self) -> None:
        """Take the progress line away."""
        if self._drawn:
            width = shutil.get_terminal_size().columns - 1
            self._write(2, "\r" + " " * width + "\r")
            self._drawn = False

    def say(self, text: str) -> None:
        """Write lines to standard output."""
        self.clear()
        self._write(1, text + "\n")

    def fail(self, text: str) -> None:
        """Write one line to standard error."""
        self.clear()
        self._write(2, "radiosity: " + " ".join(text.split()) + "\n")

    def _write(self, number: int, text: str) -> None:
        copy = dict(self._saved).get(number, number)
        if copy < 0:
            return  # the caller closed that stream: nobody listens
        data = text.encode(errors="replace")
        try:
            while data:
                data = data[os.write(copy, data) :]
        except BrokenPipeError:
            return  # nobody listens any more


def progress_line(phase: str, fraction: float, elapsed: float) -> str:
    """``phase  42 %  3 s left``; the time is left out while there is too little to judge by."""
    fraction = min(max(fraction, 0.0), 1.0)
    line = f"{phase} {100 * fraction:3.0f} %"
    if fraction < 0.03 or elapsed < 0.5:
        return line
    left = elapsed * (1 - fraction) / fraction
    return f"{line}  {_duration(left)} left"


def _duration(seconds: float) -> str:
    minutes, seconds = divmod(round(seconds), 60)
    hours, minutes = divmod(minutes, 60)
    if hours:
        return f"{hours} h {minutes} min"
    return f"{minutes} min {seconds} s" if minutes else f"{seconds} s"


def _flush() -> None:
    """Empty Python's and C's buffers, so that no text lands on the wrong side of a redirection."""
    for stream in (sys.stdout, sys.stderr):
        if stream is not None and not stream.closed:
            stream.flush()
    library = ctypes.CDLL("ucrtbase" if sys.platform == "win32" else None)
    library.fflush(None)


def _copy(number: int) -> int:
    """A duplicate of the descriptor, or −1 when it is closed."""
    try:
        return os.dup(number)
    except OSError:
        return -1
