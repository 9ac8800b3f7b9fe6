"""Runs inside the real Blender, beside the add-on: answers questions the test asks by files.

Started with ``--python inside.py -- FOLDER``. A timer looks for ``FOLDER/ask.py``, runs it with
``bpy`` at hand, and writes what it put into ``answer`` to ``FOLDER/answer.json``. The longest
pause between two ticks is what a user would feel as a frozen window. Where a processor draws the
screen most of it is drawing, in other threads: so the time of Blender's own thread is noted, too.
"""

import json
import os
import sys
import time
import traceback
from pathlib import Path

import bpy

FOLDER = Path(sys.argv[sys.argv.index("--") + 1])
TICK = 0.01  # seconds
# Between two ticks: (when it ended, how long it was, how long Blender's thread worked in it) [s].
pauses: list[tuple[float, float, float]] = []
last = time.perf_counter(), time.thread_time()
bpy.context.preferences.view.show_splash = False


def listen() -> float:
    """Note the pause since the last tick; answer a question if one was asked."""
    global last
    now = time.perf_counter(), time.thread_time()
    pauses.append((now[0], now[0] - last[0], now[1] - last[1]))
    question = FOLDER / "ask.py"
    if question.exists():
        names = {"bpy": bpy, "answer": None, "pauses": pauses}
        try:
            exec(question.read_text(), names)
            reply = {"answer": names["answer"]}
        except Exception:  # noqa: BLE001  the test is told, and fails
            reply = {"error": traceback.format_exc()}
        question.unlink()
        (FOLDER / "answer.part").write_text(json.dumps(reply))
        os.replace(FOLDER / "answer.part", FOLDER / "answer.json")
        now = time.perf_counter(), time.thread_time()
    last = now
    return TICK


bpy.app.timers.register(listen, persistent=True)
