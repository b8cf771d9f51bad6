#version 430
// A pixel: the mean of the light that its samples reflect.
const int kSide = 3;  // samples along each side of a pixel
const int kSamples = kSide * kSide;
const float kTurn = 6.2831853;
const float kOutlinedPixels = 40;  // a body of this size has full outlines; they would darken smaller ones as a whole

uniform sampler2D surface;
uniform isampler2D shown;
uniform sampler2D colour;
uniform sampler2D meeting_surface;
uniform isampler2D meeting_shown;
uniform sampler2DShadow shadow;

uniform float focal;        // in samples
uniform mat4 to_shadow;     // from the eye's frame to the shadow's, whose coordinates are 0 to 1
uniform vec3 sun;           // towards it
uniform vec3 up;
uniform float reach;        // how far bodies hide the sky from each other
uniform float glow_reach;   // how far behind others a triangle that meets some is seen
uniform float lift;         // off the surface, which would shade itself otherwise
uniform float shadow_blur;  // a radius, in the shadow's coordinates
uniform bool contacts;      // whether triangles that meet others are shown
uniform vec3 sky_above, sky_below, contact_colour;
uniform float body_size;    // metres
uniform float sun_strength, ambient, outline, glow, shine;

out vec4 pixel;

vec3 place_of(ivec2 at, float distance) {
  vec2 aside = (vec2(at) + 0.5 - 0.5 * vec2(textureSize(surface, 0))) / focal;
  return vec3(aside * distance, -distance);
}

// Part of the sky that nothing within reach hides, judged by what the picture shows. Each sample of a pixel looks along directions of its own.
float openness(ivec2 at, vec3 place, vec3 normal, float distance, int sample_index) {
  const int kDirections = 3, kSteps = 3;
  ivec2 last = textureSize(surface, 0) - 1;
  float hidden = 0;
  for (int k = 0; k < kDirections; ++k) {
    float angle = kTurn * (float(sample_index) / kSamples + k) / kDirections;
    vec2 along = focal * reach / distance * vec2(cos(angle), sin(angle));
    float highest = 0;
    for (int i = 1; i <= kSteps; ++i) {
      ivec2 other = clamp(at + ivec2(pow(float(i) / kSteps, 1.5) * along), ivec2(0), last);
      float other_distance = texelFetch(surface, other, 0).w;
      if (other_distance == 0) continue;
      vec3 ray = place_of(other, other_distance) - place;
      float length_of_ray = length(ray) + 1e-9;
      float rise = dot(ray, normal) / length_of_ray - 0.08;
      highest = max(highest, rise * clamp(2 - length_of_ray / reach, 0, 1));
    }
    hidden += highest;
  }
  return 1 - hidden / kDirections;
}

// How much of the sun a place sees. Each sample of a pixel looks at a place of its own on a small disc.
float lit(vec3 place, vec3 normal, int sample_index) {
  vec3 at = (to_shadow * vec4(place + lift * normal, 1)).xyz;
  if (at.xy != clamp(at.xy, 0, 1)) return 1;
  float radius = shadow_blur * sqrt((sample_index + 0.5) / kSamples), angle = 2.3999632 * sample_index;
  return texture(shadow, vec3(at.xy + radius * vec2(cos(angle), sin(angle)), at.z));
}

// What makes an outline where a neighbour's differs: the triangle, if it meets others, or the body.
ivec2 outlined(ivec2 at, float distance, out float strength) {
  ivec2 here = texelFetch(shown, at, 0).xy;
  strength = here.y >= 0 ? 1 : 0;
  if (!contacts || here.y >= 0) return here;
  float behind = texelFetch(meeting_surface, at, 0).w;
  if (behind > 0) strength = shine * clamp(2 - 2 * (behind - distance) / glow_reach, 0, 1);
  return ivec2(here.x, strength > 0 ? texelFetch(meeting_shown, at, 0).y : -1);
}

bool differ(ivec2 a, ivec2 b) { return a.y >= 0 || b.y >= 0 ? a.y != b.y : a.x != b.x; }

vec3 light_of(ivec2 at, int sample_index, vec3 backdrop) {
  vec4 found = texelFetch(surface, at, 0);
  float distance = found.w;
  if (distance == 0) return backdrop;
  vec3 normal = found.xyz, place = place_of(at, distance);
  float strength, ignored;
  ivec2 here = outlined(at, distance, strength);
  ivec2 last = textureSize(surface, 0) - 1;
  ivec2 right = min(at + ivec2(1, 0), last), below = max(at - ivec2(0, 1), ivec2(0));
  bool edge = differ(here, outlined(right, texelFetch(surface, right, 0).w, ignored)) ||
              differ(here, outlined(below, texelFetch(surface, below, 0).w, ignored));
  float facing = max(dot(normal, sun), 0);
  vec3 from_sun = vec3(1.05, 1, 0.93) * sun_strength * (facing > 0 ? facing * lit(place, normal, sample_index) : 0);
  vec3 from_sky = vec3(0.95, 1, 1.07) * ambient * (0.75 + 0.25 * dot(normal, up)) * openness(at, place, normal, distance, sample_index);
  vec3 light = from_sun + from_sky;
  float outlined_part = min(1, focal * body_size / (distance * kSide * kOutlinedPixels));
  vec3 reflected = mix(texelFetch(colour, at, 0).rgb, contact_colour, strength);
  return clamp(reflected * (light + glow * strength * (1 - light)) * (edge ? mix(1, outline, outlined_part) : 1), 0, 1);
}

void main() {
  ivec2 first = kSide * ivec2(gl_FragCoord.xy);
  vec3 backdrop = mix(sky_below, sky_above, gl_FragCoord.y * kSide / textureSize(surface, 0).y);
  vec3 sum = vec3(0);
  for (int i = 0; i < kSamples; ++i) sum += light_of(first + ivec2(i % kSide, i / kSide), i, backdrop);
  pixel = vec4(pow(sum / kSamples, vec3(1 / 2.2)), 1);
}
