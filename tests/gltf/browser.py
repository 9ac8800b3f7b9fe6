"""three.js in headless Chromium: a GLB file in, the picture that its page shows out."""

from __future__ import annotations

import base64
import http.server
import os
import queue
import shutil
import subprocess
import tempfile
import threading
from pathlib import Path

HERE = Path(__file__).parent
NAMES = ("chromium", "chromium-browser", "google-chrome")
TYPES = {".html": "text/html", ".js": "text/javascript", ".glb": "model/gltf-binary"}
PATIENCE = 120  # s


def chromium() -> str | None:
    """The browser's path, from RADIOSITY_CHROMIUM or PATH; None without."""
    found = (shutil.which(name) for name in NAMES)
    return os.environ.get("RADIOSITY_CHROMIUM") or next(filter(None, found), None)


def three() -> Path | None:
    """The folder of npm's package three, from RADIOSITY_THREE or node_modules; None without."""
    named = os.environ.get("RADIOSITY_THREE")
    folders = [Path(named)] if named else []
    folders += [parent / "node_modules" / "three" for parent in HERE.parents]
    folders += [Path(p) / "three" for p in ("/usr/local/lib/node_modules", "/usr/lib/node_modules")]
    return next((f for f in folders if (f / "build" / "three.module.js").is_file()), None)


def missing() -> str:
    """What keeps us from looking at a page, and the remedy; "" when nothing does."""
    if chromium() is None:
        return "no Chromium found; apt-get install chromium, or set RADIOSITY_CHROMIUM"
    if three() is None:
        return "no three.js found; npm install three, or set RADIOSITY_THREE to its folder"
    return ""


def picture(glb: Path, width: int, height: int) -> bytes:
    """The PNG of what three.js shows of ``glb`` through its first camera."""
    answers: queue.Queue = queue.Queue()
    server = http.server.ThreadingHTTPServer(("127.0.0.1", 0), _handler(glb, answers))
    threading.Thread(target=server.serve_forever, daemon=True).start()
    page = f"http://127.0.0.1:{server.server_port}/viewer.html?width={width}&height={height}"
    with tempfile.TemporaryDirectory() as profile:
        flags = ("--headless=new", "--no-sandbox", "--use-angle=swiftshader",
                 "--enable-unsafe-swiftshader", "--force-color-profile=srgb", "--no-first-run",
                 f"--user-data-dir={profile}", "--remote-debugging-port=0")  # fmt: skip
        browser = subprocess.Popen(
            [chromium(), *flags, page], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL
        )
        try:
            answer = answers.get(timeout=PATIENCE)
        finally:
            browser.terminate()
            browser.wait(20)
            server.shutdown()
    if answer.startswith(b"error"):
        raise RuntimeError(answer.decode())
    return base64.b64decode(answer)


def _handler(glb: Path, answers: queue.Queue):
    class Handler(http.server.BaseHTTPRequestHandler):
        def do_GET(self):
            path = self.path.partition("?")[0]
            file = {"/viewer.html": HERE / "viewer.html", "/scene.glb": glb}.get(path)
            if path.startswith("/three/") and ".." not in path:
                file = three() / path[len("/three/") :]
            if file is None or not file.is_file():
                return self.send_error(404)
            body = file.read_bytes()
            self.send_response(200)
            self.send_header("Content-Type", TYPES.get(file.suffix, "application/octet-stream"))
            self.send_header("Content-Length", str(len(body)))
            self.end_headers()
            self.wfile.write(body)

        def do_POST(self):
            answers.put(self.rfile.read(int(self.headers["Content-Length"])))
            self.send_response(204)
            self.end_headers()

        def log_message(self, *_):
            """Quiet."""

    return Handler
