#version 430
// Poses a body: `pose` leads from its mesh to the frame of the eye or the sun, in which z is towards them.
in vec3 corner;
in mat4x3 pose;
in vec3 colour;
in ivec2 body_and_flags;
uniform mat4 projection;
out vec3 place;
flat out vec3 body_colour;
flat out ivec2 body_flags;

void main() {
  place = pose * vec4(corner, 1);
  body_colour = colour;
  body_flags = body_and_flags;
  gl_Position = projection * vec4(place, 1);
}
