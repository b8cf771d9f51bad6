#include "triangle_families.h"

#include <algorithm>
#include <cmath>
#include <initializer_list>
#include <limits>

#include "tandem/kernels/pose.h"

namespace tandem {
namespace {

using Corner = double[3];

template <class T>
T pick(Random& random, std::initializer_list<T> values) {
  return values.begin()[uniform(random, 0, static_cast<int>(values.size()) - 1)];
}

/// Calls edit on each of the 18 coordinates.
template <class Edit>
void for_each_coordinate(TrianglePair& pair, Edit edit) {
  for (auto* t : {&pair.a, &pair.b}) {
    for (Corner& corner : *t) {
      for (double& x : corner) x = edit(x);
    }
  }
}

/// x * 2^power, finite.
double shifted(double x, int power) {
  constexpr double kLargest = std::numeric_limits<double>::max();
  return std::clamp(std::ldexp(x, power), -kLargest, kLargest);
}

void set_random(Corner& corner, Random& random, double lowest = -1, double highest = 1) {
  for (double& x : corner) x = uniform(random, lowest, highest);
}

/// x moved by up to n float64 numbers.
double nudged(Random& random, double x, int n) {
  const int steps = uniform(random, -n, n);
  for (int i = 0; i < std::abs(steps); ++i) x = std::nextafter(x, steps > 0 ? HUGE_VAL : -HUGE_VAL);
  return x;
}

/// Moves one coordinate by one last bit with some chance.
void nudge_one(TrianglePair& pair, Random& random) {
  if (uniform(random, 0, 2) != 0) return;
  double& x = pair.b[uniform(random, 0, 2)][uniform(random, 0, 2)];
  x = nudged(random, x, 1);
}

/// A corner of b comes to lie on a's plane, an edge or a corner, up to rounding and a few last bits; the rest
/// of b anywhere, or beyond a's plane.
TrianglePair corner_on_triangle(Random& random) {
  TrianglePair pair = generic_pair(random);
  double weight[3];
  for (double& w : weight) w = pick(random, {0.0, 0.25, 0.5, uniform(random, -0.1, 1.0)});
  const double sum = weight[0] + weight[1] + weight[2];
  if (sum == 0) weight[0] = 1;
  for (int k = 0; k < 3; ++k) {
    double x = 0;
    for (int i = 0; i < 3; ++i) x += weight[i] / (sum == 0 ? 1 : sum) * pair.a[i][k];
    pair.b[0][k] = nudged(random, x, pick(random, {0, 1, 4}));
  }
  return pair;
}

/// An edge of b goes through a point of an edge of a, up to rounding and a few last bits.
TrianglePair edge_on_edge(Random& random) {
  TrianglePair pair = generic_pair(random);
  const double s = pick(random, {0.0, 0.5, uniform(random, 0.0, 1.0)});
  for (int k = 0; k < 3; ++k) {
    const double x = pair.a[0][k] + s * (pair.a[1][k] - pair.a[0][k]);
    pair.b[1][k] = nudged(random, 2 * x - pair.b[0][k], pick(random, {0, 1, 4}));
  }
  return pair;
}

/// Small integer points of one integer plane, exactly coplanar at every power of two; now and then a last bit
/// beside it.
TrianglePair coplanar(Random& random) {
  int origin[3], e[2][3];
  for (int k = 0; k < 3; ++k) {
    origin[k] = uniform(random, -1000, 1000);
    e[0][k] = uniform(random, -3, 3);
    e[1][k] = uniform(random, -3, 3);
  }
  TrianglePair pair;
  for (auto* t : {&pair.a, &pair.b}) {
    for (Corner& corner : *t) {
      const int u = uniform(random, 0, 6), v = uniform(random, 0, 6);
      for (int k = 0; k < 3; ++k) corner[k] = origin[k] + u * e[0][k] + v * e[1][k];
    }
  }
  const double scale = std::ldexp(1.0, uniform(random, -60, 60));
  for_each_coordinate(pair, [&](double x) { return x * scale; });
  nudge_one(pair, random);
  return pair;
}

/// b shares one, two or three corners with a, in any order.
TrianglePair shared_corners(Random& random) {
  TrianglePair pair = uniform(random, 0, 1) == 0 ? generic_pair(random) : coplanar(random);
  int order[] = {0, 1, 2};
  std::shuffle(order, order + 3, random);
  const int count = uniform(random, 1, 3);
  for (int i = 0; i < count; ++i) std::copy_n(pair.a[order[i]], 3, pair.b[i]);
  std::shuffle(order, order + 3, random);
  TrianglePair shuffled = pair;
  for (int i = 0; i < 3; ++i) std::copy_n(pair.b[order[i]], 3, shuffled.b[i]);
  nudge_one(shuffled, random);
  return shuffled;
}

void flatten(Corner* t, Random& random, double thickness) {
  const double s = uniform(random, -0.2, 1.2);
  for (int k = 0; k < 3; ++k) {
    t[2][k] = t[0][k] + s * (t[1][k] - t[0][k]) + thickness * uniform(random, -1.0, 1.0);
  }
}

/// Triangles 10^12 times longer than wide, and flat ones up to rounding, near each other.
TrianglePair slivers(Random& random) {
  TrianglePair pair = uniform(random, 0, 1) == 0 ? edge_on_edge(random) : corner_on_triangle(random);
  if (uniform(random, 0, 2) != 0) flatten(pair.a, random, pick(random, {0.0, 1e-12, 1e-15}));
  if (uniform(random, 0, 2) != 0) flatten(pair.b, random, pick(random, {0.0, 1e-12, 1e-15}));
  return pair;
}

/// Exactly flat triangles, segments and points, on small integers.
TrianglePair flat(Random& random) {
  TrianglePair pair;
  const int size = pick(random, {1, 2, 4});
  for (auto* t : {&pair.a, &pair.b}) {
    int start[3], step[3];
    for (int k = 0; k < 3; ++k) {
      start[k] = uniform(random, 0, size);
      step[k] = uniform(random, -1, 1);
    }
    const bool is_flat = uniform(random, 0, 4) != 0, is_point = uniform(random, 0, 5) == 0;
    for (Corner& corner : *t) {
      const int s = is_point ? 0 : uniform(random, -size, size);
      for (int k = 0; k < 3; ++k) corner[k] = is_flat ? start[k] + s * step[k] : uniform(random, 0, size);
    }
  }
  nudge_one(pair, random);
  return pair;
}

TrianglePair structured(Random& random) {
  return pick(random, {generic_pair, corner_on_triangle, edge_on_edge, coplanar, shared_corners, slivers,
                       flat, grid_pair})(random);
}

/// Far from the origin, where rounding turns generic triangles into degenerate ones.
TrianglePair far_away(Random& random) {
  TrianglePair pair = structured(random);
  const double offset = pick(random, {1e7, -1e7, 1e15, 0x1p60, 1e4});
  const double scale = pick(random, {1.0, 1.0, 1e3, offset * 0x1p-50});
  for_each_coordinate(pair, [&](double x) { return x * scale + offset; });
  return pair;
}

/// float32's denormals and its largest numbers, and far outside.
TrianglePair scaled(Random& random) {
  TrianglePair pair = structured(random);
  const int power = pick(
      random, {-149, -140, -120, 100, 117, -30, -60, -260, -301, -350, -1000, -1070, 320, 337, 500, 960});
  for_each_coordinate(pair, [&](double x) { return shifted(x, power); });
  return pair;
}

/// Each axis with a scale of its own.
TrianglePair mixed_scales(Random& random) {
  TrianglePair pair = structured(random);
  const int widest = pick(random, {20, 100, 300, 900});
  for (int k = 0; k < 3; ++k) {
    const int power = uniform(random, -widest, widest);
    for (int i = 0; i < 3; ++i) {
      pair.a[i][k] = shifted(pair.a[i][k], power);
      pair.b[i][k] = shifted(pair.b[i][k], power);
    }
  }
  return pair;
}

/// A triangle, and one of another size beside it.
TrianglePair unequal(Random& random) {
  TrianglePair pair = corner_on_triangle(random);
  const double size = std::ldexp(1.0, -uniform(random, 1, 60));
  for (int i = 1; i < 3; ++i) {
    for (int k = 0; k < 3; ++k) pair.b[i][k] = pair.b[0][k] + (pair.b[i][k] - pair.b[0][k]) * size;
  }
  return pair;
}

/// The twelve triangles of a cube: corner i is at (bit 0, bit 1, bit 2).
constexpr int kCube[12][3] = {{0, 2, 1}, {1, 2, 3}, {4, 5, 6}, {5, 7, 6}, {0, 1, 4}, {1, 5, 4},
                              {2, 6, 3}, {3, 6, 7}, {0, 4, 2}, {2, 4, 6}, {1, 3, 5}, {3, 7, 5}};

Pose random_pose(Random& random) {
  static constexpr double kTurns[4][2] = {{1, 0}, {0, 1}, {0.6, 0.8}, {0.28, 0.96}};
  const double* turn = kTurns[uniform(random, 0, 3)];
  const int k = uniform(random, 0, 2), i = (k + 1) % 3, j = (k + 2) % 3;
  Pose pose = kIdentityPose;
  pose.rotation[i][i] = pose.rotation[j][j] = turn[0];
  pose.rotation[i][j] = -turn[1];
  pose.rotation[j][i] = turn[1];
  return pose;
}

/// Cubes posed alike side by side, touching in faces, edges or corners, or a last bit off it.
TrianglePair touching_cubes(Random& random) {
  Pose pose = random_pose(random);
  const double side = pick(random, {1.0, 0.1, 3.0});
  double shift[3];
  for (double& x : shift) x = side * pick(random, {-1.0, 0.0, 0.5, 1.0});
  for (double& x : pose.translation) x = pick(random, {0.0, 7.0, 1e7});
  Pose other = pose;
  apply(pose, shift[0], shift[1], shift[2], other.translation);
  TrianglePair pair;
  const int *a = kCube[uniform(random, 0, 11)], *b = kCube[uniform(random, 0, 11)];
  for (int i = 0; i < 3; ++i) {
    apply(pose, side * (a[i] & 1), side * (a[i] >> 1 & 1), side * (a[i] >> 2), pair.a[i]);
    apply(other, side * (b[i] & 1), side * (b[i] >> 1 & 1), side * (b[i] >> 2), pair.b[i]);
  }
  return pair;
}

}  // namespace

int uniform(Random& random, int lowest, int highest) {
  return std::uniform_int_distribution<int>(lowest, highest)(random);
}

double uniform(Random& random, double lowest, double highest) {
  return std::uniform_real_distribution<double>(lowest, highest)(random);
}

TrianglePair generic_pair(Random& random) {
  TrianglePair pair;
  Corner centre;
  set_random(centre, random, -0.7, 0.7);
  for (Corner& corner : pair.a) set_random(corner, random);
  for (Corner& corner : pair.b) {
    set_random(corner, random);
    for (int k = 0; k < 3; ++k) corner[k] += centre[k];
  }
  return pair;
}

TrianglePair grid_pair(Random& random) {
  TrianglePair pair;
  const int size = pick(random, {1, 2, 4, 4});
  for_each_coordinate(pair, [&](double) { return uniform(random, 0, size); });
  return pair;
}

TrianglePair any_exponent_pair(Random& random) {
  TrianglePair pair = structured(random);
  const int widest = pick(random, {300, 1000});
  for_each_coordinate(pair, [&](double x) {
    return uniform(random, 0, 3) == 0 ? shifted(x, uniform(random, -widest - 74, widest)) : x;
  });
  return pair;
}

const std::vector<TriangleFamily>& triangle_families() {
  static const std::vector<TriangleFamily> families = {{"generic", generic_pair},
                                                       {"corner on triangle", corner_on_triangle},
                                                       {"edge on edge", edge_on_edge},
                                                       {"coplanar", coplanar},
                                                       {"shared corners", shared_corners},
                                                       {"slivers", slivers},
                                                       {"flat", flat},
                                                       {"grid", grid_pair},
                                                       {"far away", far_away},
                                                       {"scaled", scaled},
                                                       {"mixed scales", mixed_scales},
                                                       {"any exponent", any_exponent_pair},
                                                       {"unequal", unequal},
                                                       {"touching cubes", touching_cubes}};
  return families;
}

std::string TriangleFamily::identifier() const {
  std::string out = name;
  std::replace(out.begin(), out.end(), ' ', '_');
  return out;
}

std::string text(const TrianglePair& pair) {
  std::string out;
  for (const auto* t : {&pair.a, &pair.b}) {
    for (const auto& corner : *t) {
      char line[120];
      std::snprintf(line, sizeof line, "  {%a, %a, %a},\n", corner[0], corner[1], corner[2]);
      out += line;
    }
  }
  return out;
}

TrianglePair swapped(const TrianglePair& pair) {
  TrianglePair out;
  std::copy_n(&pair.a[0][0], 9, &out.b[0][0]);
  std::copy_n(&pair.b[0][0], 9, &out.a[0][0]);
  return out;
}

}  // namespace tandem
