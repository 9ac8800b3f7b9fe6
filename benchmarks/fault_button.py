"""A bake from the button whose solver dies: python -m benchmarks.fault_button SCENE SECONDS

The process is killed (kill -9) so many seconds after it began to solve. What the bake says then
goes to standard error; the status is 1, and 3 where the open file has changed.
"""

from __future__ import annotations

import sys
import time

import bpy

PATIENCE = 60  # seconds


def bake_and_kill(seconds: float) -> str:
    """The message of a bake of the open file whose solver's process is killed; "" where it ended
    before."""
    from radiosity_addon.solver.expected import EXPECTED
    from radiosity_addon.ui import properties, session

    options = bpy.context.scene.radiosity
    options.target, options.resolution, options.quality = "IMAGE", 1024, "HIGH"
    bake = session.BakeSession(bpy.context.scene.name, properties.settings_of(options))
    deadline = time.monotonic() + PATIENCE
    while bake.state.name in ("START", "EXPORT") and time.monotonic() < deadline:
        bake.step(bpy.context)
    time.sleep(seconds)
    bake._process._process.kill()
    while bake.state.name != "DONE" and time.monotonic() < deadline:
        try:
            bake.step(bpy.context)
        except EXPECTED as error:
            return str(error)
        bake.wait(0.1)
    return ""


def contents() -> list[str]:
    """Names of what a bake adds."""
    meshes = [name for mesh in bpy.data.meshes for name in (*mesh.color_attributes.keys(),
                                                             *mesh.uv_layers.keys())]  # fmt: skip
    return sorted([*meshes, *bpy.data.images.keys(), *bpy.data.materials.keys()])


def main(scene: str, seconds: str) -> int:
    """Run; see above."""
    import radiosity_addon

    radiosity_addon.register()
    bpy.ops.wm.open_mainfile(filepath=scene)
    before = contents()
    message = bake_and_kill(float(seconds))
    print(f"radiosity: {message}", file=sys.stderr)
    radiosity_addon.unregister()
    return 3 if contents() != before else 1


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
