"""Needs: which light a bake has to find. The rest costs neither rays nor unknowns.

Depends on ``context``.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .context import Context
from .fields import is_black
from .scene import sides


@dataclass(frozen=True)
class Needs:
    """Light from sources that are sampled ``explicit``-ly; light that rays meet ``first``-hand,
    from the sky and from what glows; and light that was ``reflected`` on its way."""

    explicit: bool
    first: bool
    reflected: bool

    @property
    def rays(self) -> bool:
        """Whether receivers need any."""
        return self.first or self.reflected


def needs_of(context: Context, passes: tuple[str, ...]) -> Needs:
    """What the ``passes`` ask for and the scene can give."""
    scene = context.scene
    used = tuple(scene.materials[i] for i in np.unique(scene.material))
    met = np.unique(scene.material[~context.explicit])
    met = tuple(scene.materials[i] for i in met)
    glows = not all(is_black(material.emission) for material in sides(met))
    reflects = not all(is_black(material.reflectance) for material in sides(used))
    return Needs(
        explicit="direct" in passes,
        first="direct" in passes and (glows or context.sky is not None),
        reflected="indirect" in passes and reflects,
    )
