"""The shaders: the same camera, light, sky and texture filter as the rasteriser's, in GLSL.

Up to two views of a world are drawn side by side at once, one an instance. Rows of the buffer are
rows of the image, first to last, so that nothing is turned over when it is read.
"""

SCENE_VERTEX = """#version 330
in vec3 position; in vec2 uv; in float shade; in float texture_index; in float object;
uniform mat4 clip_from_world[2];
out vec2 v_uv; out float v_shade; out float v_depth;
flat out float v_texture; flat out float v_object;
void main() {
    vec4 p = clip_from_world[gl_InstanceID] * vec4(position, 1.0);
    float side = gl_InstanceID == 0 ? 1.0 : -1.0;
    gl_ClipDistance[0] = p.w - side * p.x;            // each view keeps to its half
    v_uv = uv; v_shade = shade; v_texture = texture_index; v_object = object; v_depth = p.w;
    p.x = 0.5 * (p.x - side * p.w);
    gl_Position = p;
}"""

# Taps along the longer axis as in `fragments`: OpenGL's own anisotropy takes seconds in software.
# The blend of two levels is linear in the footprint's width, which `level` makes up for.
SCENE_FRAGMENT = """#version 330
uniform sampler2DArray textures; uniform float sizes[N_TEXTURES]; uniform float array_size;
uniform float anisotropy;
in vec2 v_uv; in float v_shade; in float v_depth;
flat in float v_texture; flat in float v_object;
out vec4 colour;
void main() {
    float layer = floor(v_texture + 0.5), size = sizes[int(layer)];
    vec2 right = dFdx(v_uv) * size, down = dFdy(v_uv) * size;
    bool lying = dot(right, right) > dot(down, down);
    vec2 axis = lying ? right : down;
    float longer = length(axis), shorter = length(lying ? down : right);
    float taps = clamp(floor(longer / max(shorter, 1.0) + 0.5), 1.0, anisotropy);
    float width = clamp(longer / taps, 1.0, 0.5 * size);
    float level = floor(log2(width));
    level += width / exp2(level) - 1.0;
    float scale = size / array_size;                  // smaller textures repeat in their layer
    vec2 step = axis / (taps * max(longer, size));
    vec3 sum = vec3(0.0);
    for (float i = 0.0; i < taps; i += 1.0) {
        vec2 at = v_uv + (i - 0.5 * (taps - 1.0)) * step;
        sum += textureLod(textures, vec3(at * scale, layer), level).rgb;
    }
    colour = vec4(sum * (v_shade / taps), 1.0);
}"""

# For software drivers, to which a tap costs as much as all the rest: one, isotropic, and half a
# level sharper where two would be taken.
QUICK_SCENE_FRAGMENT = """#version 330
uniform sampler2DArray textures; uniform float sizes[N_TEXTURES]; uniform float array_size;
in vec2 v_uv; in float v_shade; in float v_depth;
flat in float v_texture; flat in float v_object;
out vec4 colour;
void main() {
    float layer = floor(v_texture + 0.5), size = sizes[int(layer)];
    vec2 right = dFdx(v_uv), down = dFdy(v_uv);
    float across = dot(right, right), along = dot(down, down);
    float shorter = max(min(across, along), 1.0 / (size * size));
    float bias = max(across, along) >= 2.25 * shorter ? -0.5 : 0.0;
    vec3 at = vec3(v_uv * (size / array_size), layer);
    colour = vec4(texture(textures, at, bias).rgb * v_shade, 1.0);
}"""

MEASURE_FRAGMENT = """#version 330
in vec2 v_uv; in float v_shade; in float v_depth;
flat in float v_texture; flat in float v_object;
out vec2 depth_and_object;
void main() { depth_and_object = vec2(v_depth, v_object); }"""

SKY_VERTEX = """#version 330
uniform vec4 intrinsics; uniform vec2 image_size; uniform vec3 up[2];
out vec3 v_ray; flat out vec3 v_up;
void main() {
    vec2 corner = vec2(gl_VertexID & 1, gl_VertexID >> 1);        // a strip of two triangles
    vec2 pixel = corner * image_size - 0.5;
    v_ray = vec3((pixel - intrinsics.zw) / intrinsics.xy, 1.0);
    v_up = up[gl_InstanceID];
    gl_ClipDistance[0] = 1.0;
    gl_Position = vec4(corner.x - (gl_InstanceID == 0 ? 1.0 : 0.0), 2.0 * corner.y - 1.0, 1.0, 1.0);
}"""

SKY_FRAGMENT = """#version 330
uniform vec3 horizon; uniform vec3 zenith;
in vec3 v_ray; flat in vec3 v_up; out vec4 colour;
void main() {
    float rise = max(dot(v_up, v_ray) / length(v_ray), 0.0);
    colour = vec4(mix(horizon, zenith, rise), 1.0);
}"""
