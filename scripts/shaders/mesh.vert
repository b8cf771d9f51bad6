#version 430
// A mesh that the eye sees along the z axis, in samples from the lower left corner of the picture, the greater z the nearer.
in vec3 corner;
in vec3 away;  // in samples: of each edge of the triangle
uniform mat4 projection;
out vec3 place;
noperspective out vec3 from_edges;

void main() {
  place = corner;
  from_edges = away;
  gl_Position = projection * vec4(corner, 1);
}
