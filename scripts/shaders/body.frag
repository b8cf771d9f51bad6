#version 430
// What a sample shows: its normal, towards the eye, and distance along the eye's axis; the body and, if its triangle meets others, which one; the body's colour.
in vec3 place;
flat in vec3 body_colour;
flat in ivec2 body_flags;  // y: where the flags of the body's triangles begin; negative: it has none
uniform bool meeting_alone;  // triangles that meet no others are left out
layout(std430, binding = 0) readonly buffer Meets { uint meets[]; };
layout(location = 0) out vec4 surface;
layout(location = 1) out ivec2 shown;
layout(location = 2) out vec4 colour;

void main() {
  int flag = body_flags.y + gl_PrimitiveID;
  bool meeting = body_flags.y >= 0 && meets[flag] != 0u;
  if (meeting_alone && !meeting) discard;
  vec3 normal = normalize(cross(dFdx(place), dFdy(place)));
  surface = vec4(dot(normal, place) > 0 ? -normal : normal, -place.z);
  shown = ivec2(body_flags.x, meeting ? flag : -1);
  colour = vec4(body_colour, 1);
}
