"""Enum items: what can be chosen in the panel, with names and descriptions."""

CUSTOM = "CUSTOM"  # the quality whose error the user names

TARGETS = (
    ("VERTEX", "Vertex Colors", "A color attribute on each mesh: as fine as the mesh, no UV map"),
    ("IMAGE", "Image Textures", "One 32-bit float image per object; a UV map without overlaps"),
)
DOMAINS = (
    ("CORNER", "Face Corner", "Keeps hard edges between faces sharp"),
    ("POINT", "Vertex", "One color per vertex: smaller, light blends over hard edges"),
)
UNWRAPS = (
    ("SMART", "Smart UV Project", "Few, large charts along the faces' directions"),
    ("LIGHTMAP", "Lightmap Pack", "A chart for each pair of faces: no stretching, many seams"),
    ("EXISTING", "Existing UV Map", "Charts of the map that renders, laid out without overlaps"),
)
SOURCES = (
    ("ALL", "All Rendered", "Every mesh that is rendered in this view layer, hidden here or not"),
    ("SELECTED", "Selected", "The selected meshes; all others still light and shadow them"),
)
QUALITIES = (
    ("DRAFT", "Draft", "10 % error: seconds, for a first look"),
    ("MEDIUM", "Medium", "3 % error: about five times the time of a draft"),
    ("HIGH", "High", "1 % error: for final bakes, about five times the time of medium"),
    (CUSTOM, "Custom", "Name the error yourself; half the error takes about three times as long"),
)
PASSES = (
    ("EMIT", "Emission", "Light that the surface itself gives off"),
    ("DIRECT", "Direct", "Light that comes straight from lamps, the sky and glowing faces"),
    ("INDIRECT", "Indirect", "Light that comes by way of other surfaces"),
    ("COLOR", "Color", "Multiply light by the surface's color; off: a lightmap without it"),
)
FORMATS = (
    ("EXR", "OpenEXR", "32-bit float, linear: keeps everything"),
    ("PNG", "PNG", "8 bits, encoded for display: brighter than white is cut off"),
    ("PNG16", "PNG, 16 bits", "As PNG, in 65,536 steps"),
    ("RGBM", "RGBM", "PNG whose alpha multiplies the color: value = scale x color x alpha"),
    ("RGBE", "RGBE", "PNG whose alpha is an exponent: value = color x 2^(255 alpha - 128)"),
    ("HDR", "Radiance HDR", "Linear with a shared exponent: small, no alpha"),
)
