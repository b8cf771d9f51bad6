#version 430
// A key light from the upper left of the viewer, a faint fill from the right, and the sky.
in vec3 place;
noperspective in vec3 from_edges;
uniform vec3 colour;
uniform vec3 up;
uniform float edge_width;  // in samples; 0: edges are not drawn
out vec4 sample_colour;

void main() {
  vec3 normal = normalize(cross(dFdx(place), dFdy(place)));
  float light = 0.42 + 0.55 * max(dot(normal, normalize(vec3(-0.45, 0.65, 0.62))), 0) + 0.14 * max(dot(normal, normalize(vec3(0.8, -0.1, 0.6))), 0) + 0.1 * dot(normal, up);
  float edge = min(from_edges.x, min(from_edges.y, from_edges.z));
  float ink = edge_width > 0 ? 0.45 * clamp(edge_width - edge + 0.5, 0, 1) : 0;
  sample_colour = vec4(min(light * colour, 1) * (1 - ink), 1);
}
