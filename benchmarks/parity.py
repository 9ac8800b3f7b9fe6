"""Parity with Cycles: each kind of lamp, world, material and geometry, baked by both.

    python -m benchmarks.parity [NAME ...] [--error 0.01] [--size 64] [--samples 96] [--list]

Without names the whole page docs/parity.md is written; with names of groups or cases only their
lines are. The error is the relative error of our bake against two independent Cycles bakes
(error.py), which are kept (references.py) until the cases' source changes.
"""

from __future__ import annotations

import argparse
import hashlib
import re
import time
from dataclasses import dataclass
from pathlib import Path

from verification.comparable_texels import comparable_texels, triangle_uvs
from verification.error import Measured, reference_noise, relative_error

from . import (
    parity_geometry,
    parity_gloss,
    parity_lamps,
    parity_links,
    parity_materials,
    parity_passes,
    parity_shading,
    parity_worlds,
)
from .buried_texels import buried_texels
from .cycles import cycles_bake
from .machine import machine
from .our_bake import our_bake, warm_up
from .parity_stage import Case
from .references import SEEDS, kept

GROUPS = {
    "lamps": parity_lamps.CASES,
    "worlds": parity_worlds.CASES,
    "materials": parity_materials.CASES,
    "gloss": parity_gloss.CASES,
    "geometry": parity_geometry.CASES,
    "links": parity_links.CASES,
    "shading": parity_shading.CASES,
    "passes": parity_passes.CASES,
}
BOUND = 0.02
TIME_LIMIT = 20.0  # seconds of solving: where the asked error is out of reach
SIZE, SAMPLES, ERROR = 64, 96, 0.01
PAGE = Path(__file__).resolve().parent.parent / "docs" / "parity.md"


@dataclass(frozen=True)
class Row:
    """One case measured. ``noise``: the relative error of one reference; ``ratio``: the mean of
    our radiance over theirs."""

    group: str
    case: Case
    error: Measured
    noise: float
    ratio: float
    seconds: float
    warnings: tuple[str, ...] = ()

    @property
    def verdict(self) -> str:
        """Agrees when the error less two standard errors is within the bound."""
        if self.case.design:
            return f"by design: {self.case.design}"
        return "agrees" if self.error.error - 2 * self.error.uncertainty <= BOUND else "DIFFERS"


def measure(group: str, case: Case, error=ERROR, size=SIZE, samples=SAMPLES, **options) -> Row:
    """Build the case in an empty file, bake it with both, ours with further ``options``, and compare."""
    obj = prepared(case.build, size)
    ours = our_bake(obj, size, error, passes=case.passes, time_limit=TIME_LIMIT, **options)
    whole = comparable_texels(triangle_uvs(obj), size) & ~buried_texels(obj, size, passes=case.passes)
    a, b, mask = references(group, case, size, samples * case.effort)
    both = whole & mask & ours.mask
    x, a, b = ours.pixels[both], a[both], b[both]
    ratio = 2 * x.mean() / (a + b).mean()
    found = relative_error(x, a, b)
    return Row(group, case, found, reference_noise(a, b), float(ratio), ours.seconds)


def references(group: str, case: Case, size: int, samples: int):
    """Two Cycles bakes (size, size, 3) of the case or of its stand-in, and the mask of both: kept
    ones, else baked now from an empty file."""

    def bake(seed):
        return cycles_bake(prepared(case.stand_in or case.build, size), size, samples, seed,
                           case.passes)  # fmt: skip

    name = re.sub(r"\W+", "-", f"parity {group} {case.name}")
    name = f"{name}-{size}-{samples}-{source_digest(group)}"
    (a, mask, _), (b, _, _) = (kept(f"{name}-{seed}", lambda: bake(seed)) for seed in SEEDS)
    return a, b, mask


def source_digest(group: str) -> str:
    """Sixteen hexadecimal digits that change with Blender's version and with the source of what
    builds the group's cases and of what has Cycles bake them."""
    import bpy

    digest = hashlib.sha256(repr(bpy.app.version).encode())
    for name in (f"parity_{group}", "parity_stage", "scene_parts", "quads", "cycles"):
        digest.update((Path(__file__).parent / f"{name}.py").read_bytes())
    return digest.hexdigest()[:16]


def prepared(build, size: int):
    """The object to bake, alone with what ``build()`` adds, in an empty file, with the UV map
    "Radiosity"."""
    import bpy

    from radiosity_addon.bake.unwrap import ensure_uv_map

    bpy.ops.wm.read_factory_settings(use_empty=True)
    obj = build()
    bpy.context.view_layer.update()
    active = obj.data.uv_layers.active.name if obj.data.uv_layers else None
    ensure_uv_map([obj], "Radiosity", size)
    if active is not None:
        obj.data.uv_layers.active = obj.data.uv_layers[active]
    bpy.context.view_layer.update()
    return obj


def chosen(names) -> list[tuple[str, Case]]:
    """(group, case) of every name, all for none. Raises ValueError naming an unknown one."""
    every = [(group, case) for group, cases in GROUPS.items() for case in cases]
    known = set(GROUPS) | {case.name for _, case in every}
    unknown = sorted(set(names) - known)
    if unknown:
        raise ValueError(f"unknown case {unknown[0]!r}; --list prints the groups and cases")
    return [(g, case) for g, case in every if not names or g in names or case.name in names]


def line(row: Row) -> str:
    """A line of the page's table."""
    return (f"| {row.group} | {row.case.name} | {100 * row.error.error:.2f} % | "
            f"{100 * row.error.uncertainty:.2f} % | {100 * (row.ratio - 1):+.2f} % | "
            f"{100 * row.noise:.1f} % | {row.seconds:.2f} | {row.verdict} |")  # fmt: skip


def run(cases, say=print, **effort) -> list[Row]:
    """Measure the cases, saying each."""
    warm_up()
    rows = []
    for group, case in cases:
        rows.append(measure(group, case, **effort))
        say(line(rows[-1]))
    return rows


def write_page(rows, path: Path, about: str, samples: int = SAMPLES) -> None:
    """Replace the page's lines of the cases in ``rows``; other cases keep their old lines."""
    old = _old_lines(path)
    new = {(row.group, row.case.name): line(row) for row in rows}
    order = [(group, case.name) for group, cases in GROUPS.items() for case in cases]
    lines = [(old | new)[key] for key in order if key in old | new]
    about = f"{about}; {len(new)} of {len(order)} cases"
    head = HEAD.format(about=about, samples=samples)
    path.write_text(head + "\n".join(lines) + "\n" + KNOWN, encoding="utf-8")


def _old_lines(path: Path) -> dict[tuple[str, str], str]:
    if not path.exists():
        return {}
    rows = [text for text in path.read_text(encoding="utf-8").splitlines() if text[:2] == "| "]
    return {tuple(part.strip() for part in text.split("|")[1:3]): text for text in rows}


HEAD = """# Agreement with Cycles

Made by `python -m benchmarks.parity`, last run on: {about}.

Each case is a floor and two walls of 4 m under a hovering slab, to which it adds one kind of lamp,
world, material or geometry. We bake it to an image at an asked error of 1 %, for 20 seconds of
solving at most; Cycles bakes it twice in the same Blender, with independent seeds, {samples} samples
(noisy cases with more), no clamping and no denoising. *Error* is the [relative error](theory.md) of our
bake against the two, and *uncertainty* its standard error from their noise. *Mean* is how much
brighter or darker our whole bake is than theirs; *noise* the error of one of the two references;
*seconds* those of our whole bake, with whatever else the machine had to do. A case agrees when its
error, less two standard errors, is within 2 %. Only texels that lie within one triangle are compared, and
none of which a part is buried in other geometry, which ours leaves out and Cycles counts as black. Lines of cases measured by name
replace those of the run before, so that not all need be of one run.

| group | case | error | uncertainty | mean | noise | seconds | verdict |
|---|---|---|---|---|---|---|---|
"""


KNOWN = """
## Known differences

* **Mirror reflections** go on as if the mirror were matte: as much light as in Cycles, all around instead of
  one way. The cases of *gloss* tell what that costs; those by design differ by it.
* **Refraction** is not modeled: light passes glass straight.
* **Translucency**: a translucent surface reflects its color diffusely on both sides and lets nothing
  through; a warning names it. Light that passes diffusely would tie the two sides of a surface
  together: the radiosity of each would depend on the light on both, so would each baked point, and
  every such point would need its rays twice. The 10 % here are those of a large slab close to the floor.
* **Light linked to objects**: lamps are linked as in Cycles; the links of an object that emits are not
  looked at, with a warning.
* **Shading normals** count where light arrives to be baked; what a surface reflects onto others follows its
  true normals. Cycles turns that light too, and loses what its normal maps mask: strong maps on all of a
  room make its indirect light darker.
* **Displacement** that moves the surface is not modeled, with a warning; as bump it is.
* **Two sides**: where a node tree asks which side is seen (the Backfacing output), each side has its own
  reflectance, transmittance and emission.
* **Lighting without color on black surfaces**: Cycles bakes black there, we the light. The case
  of direct light is compared with Cycles' bake of a surface that reflects 0.0001, that of indirect
  light with a small sheet that reflects 0.2 where ours reflects nothing.
* **The texel's footprint**: we average over all of a texel's square, as Cycles does in Blender 5.2. In
  4.5 and 5.0 its bake averages over the middle half of the texel's width and height, so pictures that
  step from texel to texel differ there (by 6 % at 32², with the mean exact).
"""


def main(arguments=None) -> None:
    parser = argparse.ArgumentParser(prog="python -m benchmarks.parity", description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)  # fmt: skip
    parser.add_argument("names", nargs="*", help="groups or cases; none: all")
    parser.add_argument("--error", type=float, default=ERROR)
    parser.add_argument("--size", type=int, default=SIZE)
    parser.add_argument("--samples", type=int, default=SAMPLES)
    parser.add_argument("--page", type=Path, default=PAGE, help="where the table goes")
    parser.add_argument("--list", action="store_true", help="print the cases and stop")
    options = parser.parse_args(arguments)
    try:
        cases = chosen(options.names)
    except ValueError as error:
        parser.error(str(error))
    if options.list:
        print("\n".join(f"{group}: {case.name}" for group, case in cases))
        return
    effort = {"error": options.error, "size": options.size, "samples": options.samples}
    start = time.perf_counter()
    rows = run(cases, **effort)
    minutes = (time.perf_counter() - start) / 60
    about = f"{machine()}; {minutes:.0f} minutes"
    write_page(rows, options.page, about, options.samples)


if __name__ == "__main__":
    main()
