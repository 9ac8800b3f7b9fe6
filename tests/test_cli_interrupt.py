"""Signals: they lead out fast, whatever the process is doing; a second program proves it."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import textwrap
import threading
import time
from pathlib import Path

import pytest

from radiosity_addon.interrupt import Interrupts

ROOT = Path(__file__).resolve().parents[1]

pytestmark = pytest.mark.skipif(os.name == "nt", reason="sends POSIX signals")


def run_and_signal(body: str, number: int, tmp_path) -> tuple[int, str, float]:
    """Run ``body``, signal it once it says ready; (status, output, seconds until it ended)."""
    script = tmp_path / "script.py"
    script.write_text(textwrap.dedent(body))
    child = subprocess.Popen(
        [sys.executable, str(script)],
        cwd=ROOT,
        stdout=subprocess.PIPE,
        text=True,
        env={**os.environ, "PYTHONPATH": str(ROOT)},
    )
    assert child.stdout.readline() == "ready\n"
    time.sleep(0.1)
    sent = time.monotonic()
    child.send_signal(number)
    text = child.stdout.read()
    return child.wait(10), text, time.monotonic() - sent


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_signal_becomes_keyboard_interrupt_and_clean_up_may_take_its_time(number, tmp_path):
    status, text, _ = run_and_signal(
        """
        import time
        from radiosity_addon.interrupt import Interrupts
        with Interrupts(lambda: None) as interrupts:
            try:
                print("ready", flush=True)
                time.sleep(20)
            except KeyboardInterrupt:
                interrupts.caught()
                time.sleep(1)  # longer than the patience with those who never caught it
                print("led out")
        """,
        number,
        tmp_path,
    )
    assert (status, text) == (0, "led out\n")


@pytest.mark.timed
def test_call_into_c_that_does_not_return_is_left_within_a_second(tmp_path):
    """A lock taken twice in C by ctypes: no Python handler can run, as in a long Blender call."""
    status, text, seconds = run_and_signal(
        """
        import ctypes
        from radiosity_addon.interrupt import Interrupts
        libc = ctypes.CDLL(None)
        lock = ctypes.create_string_buffer(128)  # a pthread_mutex_t, zero-initialized
        libc.pthread_mutex_lock(lock)
        with Interrupts(lambda: print("last act", flush=True)):
            print("ready", flush=True)
            libc.pthread_mutex_lock(lock)
        """,
        signal.SIGINT,
        tmp_path,
    )
    assert (status, text) == (130, "last act\n")
    assert seconds < 1


def test_exception_lost_in_a_callback_is_raised_by_the_next_check(tmp_path):
    status, text, _ = run_and_signal(
        """
        import time
        from radiosity_addon.interrupt import Interrupts
        with Interrupts(lambda: None) as interrupts:
            try:
                print("ready", flush=True)
                time.sleep(20)
            except BaseException:
                pass  # as Python does with what a callback from C raises
            try:
                interrupts.check()
            except KeyboardInterrupt:
                print("remembered")
        """,
        signal.SIGINT,
        tmp_path,
    )
    assert (status, text) == (0, "remembered\n")


def test_held_section_ends_first(tmp_path):
    status, text, _ = run_and_signal(
        """
        import time
        from radiosity_addon.interrupt import Interrupts
        with Interrupts(lambda: None) as interrupts:
            with interrupts.held():
                print("ready", flush=True)
                time.sleep(1.2)
                print("whole")
            try:
                interrupts.check()
            except KeyboardInterrupt:
                print("then out")
        """,
        signal.SIGINT,
        tmp_path,
    )
    assert (status, text) == (0, "whole\nthen out\n")


@pytest.mark.timed
def test_quiet_section_is_left_the_hard_way(tmp_path):
    status, text, seconds = run_and_signal(
        """
        import time
        from radiosity_addon.interrupt import Interrupts
        with Interrupts(lambda: print("last act", flush=True)) as interrupts:
            with interrupts.quiet():
                print("ready", flush=True)
                time.sleep(20)
        """,
        signal.SIGINT,
        tmp_path,
    )
    assert (status, text) == (130, "last act\n")
    assert seconds < 1


def test_handlers_are_put_back():
    before = [signal.getsignal(number) for number in (signal.SIGINT, signal.SIGTERM)]
    with Interrupts(lambda: None):
        assert signal.getsignal(signal.SIGTERM) is not before[1]
    assert [signal.getsignal(number) for number in (signal.SIGINT, signal.SIGTERM)] == before


def test_other_threads_do_not_listen():
    """Python allows signal handlers in the main thread only; elsewhere a bake still works."""
    outcome = []

    def enter():
        with Interrupts(lambda: None) as interrupts:
            interrupts.check()
            outcome.append("entered")

    thread = threading.Thread(target=enter)
    thread.start()
    thread.join()
    assert outcome == ["entered"]
