"""The programs of the graphics card that draw a bake: as displayed, and without stairs at edges."""

from __future__ import annotations

from functools import lru_cache

from .display import FIRST, SIZE, STEPS

VERTEX = """
void main() {
  value = baked;
  gl_Position = ModelViewProjectionMatrix * vec4(pos, 1.0);
}
"""
# Places on the axes of display.table_of, and what lies between the eight points around them.
DISPLAY = f"""
float place(float x) {{
  float first = exp2(float({FIRST}));
  float at = x < first ? x / first : 1.0 + (log2(x) - float({FIRST})) * float({STEPS});
  return min(at, float({SIZE - 1}));
}}
vec3 at(int r, int g, int b) {{
  return texelFetch(table, ivec2(b * {SIZE} + r, g), 0).rgb;
}}
vec3 displayed(vec3 light) {{
  vec3 p = vec3(place(light.r), place(light.g), place(light.b));
  ivec3 a = min(ivec3(p), ivec3({SIZE - 2}));
  ivec3 b = a + 1;
  vec3 t = p - vec3(a);
  vec3 near = mix(mix(at(a.r, a.g, a.b), at(b.r, a.g, a.b), t.r),
                  mix(at(a.r, b.g, a.b), at(b.r, b.g, a.b), t.r), t.g);
  vec3 far = mix(mix(at(a.r, a.g, b.b), at(b.r, a.g, b.b), t.r),
                 mix(at(a.r, b.g, b.b), at(b.r, b.g, b.b), t.r), t.g);
  return mix(near, far, t.b);
}}
"""
# The alpha of an image is not looked at: it is 0 in the margin.
IMAGE = DISPLAY + """
void main() {
  vec3 light = max(texture(image, value.xy).rgb, vec3(0.0));
  shown = vec4(displayed(light * factor), 1.0);
}
"""
COLORS = DISPLAY + """
void main() {
  shown = vec4(displayed(max(value, vec3(0.0)) * factor), 1.0);
}
"""
OVER_THE_VIEW = """
void main() {
  place = 0.5 * pos + 0.5;
  gl_Position = vec4(pos, 0.0, 1.0);
}
"""
# Light is averaged, not its codes. Blender takes what is drawn over a viewport for light, which it
# encodes by this exponent, not by sRGB's curve.
MEAN = """
void main() {
  ivec2 corner = ivec2(place * vec2(textureSize(canvas, 0) / samples)) * samples;
  vec4 sum = vec4(0.0);
  for (int y = 0; y < samples; y++) {
    for (int x = 0; x < samples; x++) {
      vec4 each = texelFetch(canvas, corner + ivec2(x, y), 0);
      sum += vec4(pow(each.rgb, vec3(2.2)) * each.a, each.a);
    }
  }
  shown = sum / float(samples * samples);
}
"""


@lru_cache(maxsize=2)
def bake_shader(textured: bool):
    """Draws the triangles of one object: texture coordinates of an image, or colors."""
    import gpu

    between = gpu.types.GPUStageInterfaceInfo("radiosity_value")
    between.smooth("VEC3", "value")
    info = gpu.types.GPUShaderCreateInfo()
    info.push_constant("MAT4", "ModelViewProjectionMatrix")
    info.push_constant("FLOAT", "factor")
    info.sampler(0, "FLOAT_2D", "table")
    if textured:
        info.sampler(1, "FLOAT_2D", "image")
    info.vertex_in(0, "VEC3", "pos")
    info.vertex_in(1, "VEC3", "baked")
    info.vertex_out(between)
    info.fragment_out(0, "VEC4", "shown")
    info.vertex_source(VERTEX)
    info.fragment_source(IMAGE if textured else COLORS)
    return gpu.shader.create_from_info(info)


@lru_cache(maxsize=1)
def mean_shader():
    """Draws a canvas of ``samples`` times the width and height over the whole viewport."""
    import gpu

    between = gpu.types.GPUStageInterfaceInfo("radiosity_place")
    between.smooth("VEC2", "place")
    info = gpu.types.GPUShaderCreateInfo()
    info.push_constant("INT", "samples")
    info.sampler(0, "FLOAT_2D", "canvas")
    info.vertex_in(0, "VEC2", "pos")
    info.vertex_out(between)
    info.fragment_out(0, "VEC4", "shown")
    info.vertex_source(OVER_THE_VIEW)
    info.fragment_source(MEAN)
    return gpu.shader.create_from_info(info)


def hole_shader():
    """Draws nothing but depth: what lies there is shown as Blender draws it."""
    import gpu

    return gpu.shader.from_builtin("UNIFORM_COLOR")


def forget() -> None:
    """Free them."""
    bake_shader.cache_clear()
    mean_shader.cache_clear()
