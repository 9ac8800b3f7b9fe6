"""What the terminal shows, on a pseudo-terminal and elsewhere."""

from __future__ import annotations

import os
import subprocess
import sys
import textwrap
from pathlib import Path

import pytest

from radiosity_addon.terminal import Terminal, progress_line

ROOT = Path(__file__).resolve().parents[1]


@pytest.mark.parametrize(
    ("fraction", "elapsed", "line"),
    [
        (0.0, 0.0, "Gather   0 %"),
        (0.02, 10.0, "Gather   2 %"),  # too little to judge by
        (0.5, 0.2, "Gather  50 %"),
        (0.5, 7.0, "Gather  50 %  7 s left"),  # half took 7 s, so half is left
        (0.25, 30.0, "Gather  25 %  1 min 30 s left"),  # 3 × 30 s
        (0.1, 1200.0, "Gather  10 %  3 h 0 min left"),  # 9 × 20 min
        (1.5, 3.0, "Gather 100 %  0 s left"),
    ],
)
def test_progress_line(fraction, elapsed, line):
    assert progress_line("Gather", fraction, elapsed) == line


def test_chatter_from_c_is_kept_out_and_our_words_come_through(capfd):
    with Terminal() as terminal:
        os.write(1, b"Read blend: chatter\n")
        os.write(2, b"Warning: chatter\n")
        terminal.say("five lines")
        terminal.fail("one\nline")
    os.write(1, b"afterward\n")
    out, err = capfd.readouterr()
    assert out == "five lines\nafterward\n"
    assert err == "radiosity: one line\n"


def test_no_progress_where_stderr_is_no_terminal(capfd):
    with Terminal() as terminal:
        terminal.progress("Gather", 0.5)
    assert capfd.readouterr() == ("", "")


def test_debugging_shows_the_chatter(capfd, monkeypatch):
    monkeypatch.setenv("RADIOSITY_DEBUG", "1")
    with Terminal():
        os.write(1, b"Read blend\n")
    assert capfd.readouterr().out == "Read blend\n"


@pytest.mark.skipif(os.name == "nt", reason="pseudo-terminals are POSIX")
def test_progress_on_a_terminal_is_one_line_and_is_cleared():
    import pty

    script = """
        import time
        from radiosity_addon.terminal import Terminal
        with Terminal() as terminal:
            terminal.progress("Gather", 0.25)
            terminal.progress("Gather", 0.26)  # too soon to be drawn
            time.sleep(0.15)
            terminal.progress("Write", 0.75)
    """
    ours, theirs = pty.openpty()
    status = subprocess.run(
        [sys.executable, "-c", textwrap.dedent(script)], cwd=ROOT, stderr=theirs
    ).returncode
    os.close(theirs)
    text = os.read(ours, 10000).decode()
    os.close(ours)
    assert status == 0
    assert "\n" not in text
    states = [state.rstrip() for state in text.split("\r")]
    assert states == ["", "Gather  25 %", "Write  75 %", "", ""]


@pytest.mark.skipif(os.name == "nt", reason="closes descriptors the POSIX way")
def test_closed_streams_are_no_failure():
    code = "from radiosity_addon.terminal import Terminal\nwith Terminal() as t: t.say('x')"
    status = subprocess.run(
        ["/bin/sh", "-c", 'exec "$0" -c "$1" >&- 2>&-', sys.executable, code], cwd=ROOT
    ).returncode
    assert status == 0
