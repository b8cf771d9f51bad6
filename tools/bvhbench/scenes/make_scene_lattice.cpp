#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>

#include "make_scene.h"

// Scenes on a cubic lattice: stack, pile, lattice, field, coincident.
namespace tandem::bench {
namespace {

// Cell i of a cubic lattice of side n, x first.
Vector cell(std::uint32_t i, std::uint32_t n) {
  return {static_cast<double>(i % n), static_cast<double>(i / n % n), static_cast<double>(i / n / n)};
}

// Returns where a coordinate of the mesh comes to lie under an identity rotation: as apply() computes it.
double posed(double x, double origin, double translation) {
  return x + (origin + translation);
}

// The translation next to `previous` with which the box's lower end lies exactly where the upper end of the
// box before lies.
double next_translation(const FileHeader& box, int axis, double previous) {
  constexpr int kMostSteps = 64;
  const double lower = box.lower[axis], upper = box.upper[axis], origin = box.origin[axis];
  const double wanted = posed(upper, origin, previous);
  double translation = previous + (upper - lower);
  for (int i = 0; i < kMostSteps; ++i) {
    const double found = posed(lower, origin, translation);
    if (found == wanted) return translation;
    translation = std::nextafter(translation, found < wanted ? HUGE_VAL : -HUGE_VAL);
  }
  throw std::runtime_error("no float64 positions let the faces of these boxes coincide");
}

// Translations along an axis with which boxes stand face to face.
std::vector<double> exact_row(const FileHeader& box, int axis, std::uint32_t side, double start) {
  std::vector<double> row = {start};
  while (row.size() < side) row.push_back(next_translation(box, axis, row.back()));
  return row;
}

std::vector<double> even_row(const Bounds& box, int axis, std::uint32_t side, double start) {
  std::vector<double> row;
  for (std::uint32_t i = 0; i < side; ++i) row.push_back(start + i * (box.upper[axis] - box.lower[axis]));
  return row;
}

// The cube root of a number near 1 by Newton's method: std::cbrt differs between platforms.
double cube_root(double x) {
  double root = 1;
  for (int i = 0; i < 20; ++i) root = (2 * root + x / (root * root)) / 3;
  return root;
}

// Bodies of a pile in lattice units.
struct Draft {
  std::vector<Rotation> rotations;
  std::vector<Vector> positions;
};

// Adds bodies to a draft, moved by up to `jitter` spacings along each axis. position(i): that of body i.
template <typename Position>
void add_bodies(Draft& draft, std::uint32_t count, double jitter, Random& random, const Position& position) {
  for (std::uint32_t i = 0; i < count; ++i) {
    Vector at = position(i);
    for (double& x : at) x += random.between(-jitter, jitter);
    draft.positions.push_back(at);
    draft.rotations.push_back(random_rotation(random));
  }
}

Draft draft_pile(std::uint32_t count, double jitter, Random& random) {
  const std::uint32_t side = root_above(count, 3);
  Draft draft;
  add_bodies(draft, count, jitter, random, [&](std::uint32_t i) { return cell(i, side); });
  return draft;
}

// The longest side of a body's bounds.
double length_of(const Bounds& bounds) {
  double length = 0;
  for (int k = 0; k < 3; ++k) length = std::max(length, bounds.upper[k] - bounds.lower[k]);
  return length;
}

std::vector<Instance> spread(const Draft& draft, const Vector& centre, double spacing) {
  std::vector<Instance> instances;
  instances.reserve(draft.positions.size());
  for (std::size_t i = 0; i < draft.positions.size(); ++i) {
    Vector position = draft.positions[i];
    for (double& x : position) x *= spacing;
    instances.push_back(place(0, draft.rotations[i], centre, position));
  }
  return instances;
}

}  // namespace

std::vector<Instance> make_stack(const AssetView& box, std::uint32_t side, double jitter,
                                 const SceneSeed& seed) {
  const Bounds bounds = bounds_of(box);
  std::vector<double> rows[3];
  for (int k = 0; k < 3; ++k) {
    rows[k] = jitter == 0 ? exact_row(*box.header, k, side, seed.offset[k])
                          : even_row(bounds, k, side, seed.offset[k]);
  }
  Random random(seed.seed);
  std::vector<Instance> instances(std::size_t{side} * side * side, Instance{0, kIdentityPose});
  for (std::uint32_t i = 0; i < instances.size(); ++i) {
    const std::uint32_t at[3] = {i % side, i / side % side, i / side / side};
    for (int k = 0; k < 3; ++k) {
      const double length = bounds.upper[k] - bounds.lower[k];
      const double moved = jitter == 0 ? 0 : length * random.between(-jitter, jitter);
      instances[i].pose.translation[k] = rows[k][at[k]] + moved;
    }
  }
  return instances;
}

std::vector<Instance> make_pile(const AssetView& body, std::uint32_t count, double neighbours,
                                const SceneSeed& seed) {
  constexpr int kMostSteps = 60;
  if (neighbours > count - 1) {
    throw std::runtime_error(std::to_string(count) + " bodies cannot have so many neighbours each");
  }
  Random random(seed.seed);
  const Draft draft = draft_pile(count, 0.75, random);
  const Bounds bounds = bounds_of(body);
  double too_close = 0, too_wide = HUGE_VAL, best_miss = HUGE_VAL;
  double spacing = bounds.diagonal(), best = spacing;
  // Neighbours go with the density, the spacing's inverse cube; where a step by that leaves what is known of
  // the spacing, it is halved instead.
  for (int step = 0; step < kMostSteps && best_miss > 0.005; ++step) {
    const auto pairs = find_box_pairs({body}, spread(draft, bounds.centre(), spacing));
    const double found = 2 * static_cast<double>(pairs.size()) / count;
    const double miss = std::fabs(found - neighbours) / neighbours;
    if (miss < best_miss) best_miss = miss, best = spacing;
    (found > neighbours ? too_close : too_wide) = spacing;
    spacing *= cube_root(std::clamp(found / neighbours, 0.3, 3.0));
    if (spacing <= too_close || spacing >= too_wide) spacing = 0.5 * (too_close + too_wide);
  }
  std::vector<Instance> instances = spread(draft, bounds.centre(), best);
  move(instances, seed.offset);
  return instances;
}

std::vector<Instance> make_lattice(const AssetView& body, std::uint32_t count, double spacing,
                                   const SceneSeed& seed) {
  Random random(seed.seed);
  const Draft draft = draft_pile(count, 0.25, random);
  const Bounds bounds = bounds_of(body);
  std::vector<Instance> instances = spread(draft, bounds.centre(), spacing * length_of(bounds));
  move(instances, seed.offset);
  return instances;
}

std::vector<Instance> make_field(const AssetView& body, std::uint32_t fixed, std::uint32_t count,
                                 double spacing, const SceneSeed& seed) {
  constexpr double kJitter = 0.25;
  Random random(seed.seed);
  Draft draft;
  const std::uint32_t wide = root_above(fixed, 2), side = root_above(count, 3);
  const double middle = 0.5 * (static_cast<double>(wide) - static_cast<double>(side));
  add_bodies(draft, fixed, kJitter, random, [&](std::uint32_t i) { return cell(i, wide); });
  add_bodies(draft, count, kJitter, random, [&](std::uint32_t i) {
    const Vector at = cell(i, side);
    return Vector{at[0] + middle, at[1] + middle, at[2] + 1};
  });
  const Bounds bounds = bounds_of(body);
  std::vector<Instance> instances = spread(draft, bounds.centre(), spacing * length_of(bounds));
  move(instances, seed.offset);
  return instances;
}

std::vector<Instance> make_coincident(const AssetView& body, std::uint32_t count, const SceneSeed& seed) {
  Random random(seed.seed);
  const Bounds bounds = bounds_of(body);
  const std::uint32_t side = root_above(count, 3);
  std::vector<Instance> instances;
  for (std::uint32_t i = 0; i < count; ++i) {
    // A world box reaches half a diagonal from its body's centre at most, however the body is turned.
    Vector position = cell(i, side);
    for (double& x : position) x *= 2 * bounds.diagonal();
    const Instance instance = place(0, random_rotation(random), bounds.centre(), position);
    instances.insert(instances.end(), {instance, instance});
  }
  move(instances, seed.offset);
  return instances;
}

}  // namespace tandem::bench
