// The two passes of the stripe renderer: depth seen from the projector, then the camera's picture.
//
// Vertices come with their pixels in camera and projector already computed (lens distortion included):
// `in_camera`, `in_projector` = (pixel x, pixel y, w). Clip depth: z = a·w + b, so that z/w grows with w.
#pragma once

namespace selvedge::render {

inline constexpr const char* kDepthVertexShader = R"(#version 330 core
layout(location = 1) in vec3 in_projector;
uniform vec2 size;          // projector, px
uniform vec2 depth_scale;   // a, b
void main() {
  float w = in_projector.z;
  vec2 ndc = 2.0 * (in_projector.xy + 0.5) / size - 1.0;
  gl_Position = vec4(ndc * w, depth_scale.x * w + depth_scale.y, w);
}
)";

inline constexpr const char* kDepthFragmentShader = R"(#version 330 core
void main() {}
)";

inline constexpr const char* kCameraVertexShader = R"(#version 330 core
layout(location = 0) in vec3 in_camera;
layout(location = 1) in vec3 in_projector;
layout(location = 2) in vec3 in_position;
layout(location = 3) in vec3 in_normal;
uniform vec2 size;          // camera, px
uniform vec2 depth_scale;
out vec3 light_h;           // projector column·w, row·w, w: linear in space
out vec3 position;
out vec3 normal;
void main() {
  float w = in_camera.z;
  vec2 ndc = 2.0 * (in_camera.xy + 0.5) / size - 1.0;
  gl_Position = vec4(ndc * w, depth_scale.x * w + depth_scale.y, w);
  light_h = vec3(in_projector.xy * in_projector.z, in_projector.z);
  position = in_position;
  normal = in_normal;
}
)";

inline constexpr const char* kCameraFragmentShader = R"(#version 330 core
in vec3 light_h;
in vec3 position;
in vec3 normal;
out vec4 colour;
uniform float horizontal;        // 1: brightness goes by projector row
uniform vec2 projector_size;
uniform vec2 shadow_depth_scale;
uniform float shadow_bias;       // in w of the projector
uniform vec2 grey;               // ambient, lit, 0 to 1
uniform vec3 eye;
uniform vec3 lamp;
uniform sampler2DShadow shadow_map;
uniform sampler1D profile;       // brightness across the projector, blurred

void main() {
  vec2 lit_by = light_h.xy / light_h.z;
  vec2 at = (lit_by + 0.5) / projector_size;
  float shown = texture(profile, horizontal > 0.5 ? at.y : at.x).r;

  vec3 n = normalize(normal), to_lamp = normalize(lamp - position);
  float facing = dot(n, to_lamp);
  float light = facing * dot(n, eye - position) > 0.0 ? abs(facing) : 0.0;

  bool in_beam = light_h.z > 0.0 && all(greaterThanEqual(at, vec2(0.0))) && all(lessThanEqual(at, vec2(1.0)));
  float w = light_h.z - shadow_bias;
  float z = 0.5 + 0.5 * (shadow_depth_scale.x + shadow_depth_scale.y / w);
  light *= in_beam ? texture(shadow_map, vec3(at, z)) : 0.0;

  colour = vec4(vec3(grey.x + (grey.y - grey.x) * light * shown), 1.0);
}
)";

}  // namespace selvedge::render
