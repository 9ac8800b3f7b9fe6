"""Ctrl-C and termination: stop within a second, with everything put back. No bpy.

Blender installs a handler of its own for SIGINT, and a long call into C lets no Python handler
run. So a signal does three things: it raises KeyboardInterrupt as soon as Python runs again, it
is remembered for ``check`` (an exception raised inside a callback from C is lost), and a thread
that waits beside the blocked main thread ends the process when neither has led out in time.
"""

from __future__ import annotations

import os
import signal
import socket
import threading
from contextlib import contextmanager
from typing import Callable

PATIENCE = 0.2  # time [s] between the signal and the hard way out
INTERRUPTED = 130  # code [exit status]
SIGNALS = (signal.SIGINT, signal.SIGTERM)


class Interrupts:
    """Listens to SIGINT and SIGTERM while the context is open; only in the main thread.

    ``last_act`` is called before the hard way out; it must only remove files.
    """

    def __init__(self, last_act: Callable[[], None]) -> None:
        self._last_act = last_act
        self._received = False
        self._held = False  # no way out at all
        self._quiet = False  # no exception
        self._leaving = threading.Lock()
        self._left = threading.Event()  # set when the signal has led out, or nobody waits

    def __enter__(self) -> Interrupts:
        self._listens = threading.current_thread() is threading.main_thread()
        if self._listens:
            self._bell, self._ear = socket.socketpair()
            self._bell.setblocking(False)
            self._old_bell = signal.set_wakeup_fd(self._bell.fileno(), warn_on_full_buffer=False)
            self._old = [signal.signal(number, self._on_signal) for number in SIGNALS]
            threading.Thread(target=self._watch, daemon=True).start()
        return self

    def __exit__(self, *_) -> None:
        self._left.set()
        if self._listens:
            for number, old in zip(SIGNALS, self._old):
                signal.signal(number, signal.SIG_DFL if old is None else old)
            signal.set_wakeup_fd(self._old_bell)
            self._bell.close()  # the thread hears the end of the line and returns

    def check(self) -> None:
        """Raise KeyboardInterrupt if a signal came and the exception it raised was lost."""
        if self._received and not self._quiet:
            raise KeyboardInterrupt

    @contextmanager
    def held(self):
        """A short section that is not to be cut in two: a signal waits for its end."""
        self._held = self._quiet = True
        try:
            yield
        finally:
            self._held = self._quiet = False

    @contextmanager
    def quiet(self):
        """A section that an exception would break, such as the import of bpy: a signal ends the
        process there the hard way, or raises KeyboardInterrupt at its end, whichever is first."""
        self._quiet = True
        try:
            yield
        finally:
            self._quiet = False
        self.check()

    def caught(self) -> None:
        """The signal has led out to the caller: the hard way is not needed."""
        self._left.set()

    def leave(self) -> None:
        """End the process at once, without the peace that Blender would make of it."""
        self._leaving.acquire()  # whoever comes second waits for the end
        self._last_act()
        os._exit(INTERRUPTED)

    def _on_signal(self, *_) -> None:
        first, self._received = not self._received, True
        if first and not self._quiet:
            raise KeyboardInterrupt

    def _watch(self) -> None:
        """Wait for a signal's number on the bell, then for the main thread to come out."""
        with self._ear:
            heard = self._ear.recv(1)
            while heard and heard[0] not in SIGNALS:
                heard = self._ear.recv(1)
        while heard and not self._left.wait(0 if self._quiet and not self._held else PATIENCE):
            if not self._held:
                self.leave()
