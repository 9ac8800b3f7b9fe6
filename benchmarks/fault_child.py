"""A bake that says which stage it is at: python -m benchmarks.fault_child [its words]

The names of the stages go, one a line, into the file named by RADIOSITY_STAGES. Otherwise it is
``python -m radiosity_addon``.
"""

from __future__ import annotations

import importlib
import os

STAGES = {  # in order; what is called when one begins
    "start": "radiosity_addon.command:_import_bpy",
    "open": "radiosity_addon.command:open_scene",
    "export": "radiosity_addon.bake_job:prepare",
    "elements": "radiosity_addon.solver.sequence:build_context",
    "transport": "radiosity_addon.solver.transport.solve_patches:trace_transport",
    "solve": "radiosity_addon.solver.transport.radiosity:solve_second_kind",
    "gather": "radiosity_addon.solver.adaptive.replicate:add_gathered",
    "write": "radiosity_addon.bake_job:apply",
    "save": "radiosity_addon.command:_save",
}


def announce(stage: str, place: str) -> None:
    """Have the function at ``place`` write ``stage`` to the file of stages before it begins."""
    module, _, name = place.partition(":")
    module = importlib.import_module(module)
    function = getattr(module, name)

    def announced(*arguments, **options):
        with open(os.environ["RADIOSITY_STAGES"], "a") as handle:
            handle.write(stage + "\n")
        return function(*arguments, **options)

    setattr(module, name, announced)


if __name__ == "__main__":
    for stage, place in STAGES.items():
        announce(stage, place)
    importlib.import_module("radiosity_addon.__main__").run()
