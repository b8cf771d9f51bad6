#include "configurations.h"

#include <new>
#include <stdexcept>

#include "bvhbench/scenes/make_scene.h"
#include "bvhbench/scenes/make_scene_parts.h"
#include "tandem/kernels/contact_query.h"

namespace tandem::simulation {
namespace {

// Bodies near the points of a cubic lattice.
class Lattice {
 public:
  Lattice(const AssetView& body, const Bounds& ground, std::uint32_t count, double spacing)
      : bounds_(bounds_of(body)), side_(bench::root_above(count, 3)), spacing_(spacing) {
    const Vector middle = ground.centre();
    const double half = 0.5 * spacing * (side_ - 1);
    // No body reaches further down than half its diagonal.
    first_ = {middle[0] - half, middle[1] - half,
              ground.upper[2] + 0.5 * bounds_.diagonal() + kJitter * spacing};
  }

  Instance draw(std::uint32_t i, Random& random) const {
    const std::uint32_t at[3] = {i % side_, i / side_ % side_, i / side_ / side_};
    Vector position;
    for (int k = 0; k < 3; ++k) {
      position[k] = first_[k] + spacing_ * (at[k] + random.between(-kJitter, kJitter));
    }
    return place(0, random_rotation(random), bounds_.centre(), position);
  }

 private:
  static constexpr double kJitter = 0.1;  // of the spacing

  Bounds bounds_;
  std::uint32_t side_;
  double spacing_;
  Vector first_;
};

// The second body of each pair that touches.
std::vector<std::uint32_t> touching(ContactQuery& query, const std::vector<Instance>& bodies) {
  ContactOptions options;
  options.first_contact_only = true;
  const Status status = query.find_contacts(bodies, options);
  if (status == Status::kOutOfMemory) throw std::bad_alloc();
  if (status != Status::kOk) throw std::runtime_error(explain(status));
  std::vector<std::uint32_t> found;
  for (const Contact& contact : query.contacts()) found.push_back(query.pairs()[contact.pair].b);
  return found;
}

// Draws bodies anew until none touch; false: that did not help.
bool spread(const Lattice& lattice, ContactQuery& query, Random& random, std::vector<Instance>& bodies) {
  constexpr int kRounds = 60;
  for (std::uint32_t i = 0; i < bodies.size(); ++i) bodies[i] = lattice.draw(i, random);
  for (int round = 0; round < kRounds; ++round) {
    const std::vector<std::uint32_t> again = touching(query, bodies);
    if (again.empty()) return true;
    for (const std::uint32_t i : again) bodies[i] = lattice.draw(i, random);
  }
  return false;
}

}  // namespace

void Configuration::add(const Instance& instance, Motion moved_by) {
  instances.push_back(instance);
  motion.push_back(moved_by);
}

Configuration structured_stack(const AssetView& box, std::uint32_t side, double jitter, double sink,
                               std::uint64_t seed) {
  const Bounds bounds = bounds_of(box);
  const double length[3] = {bounds.upper[0] - bounds.lower[0], bounds.upper[1] - bounds.lower[1],
                            bounds.upper[2] - bounds.lower[2]};
  Random random(seed);
  Configuration stack;
  for (std::uint32_t layer = 0; layer <= side; ++layer) {
    for (std::uint32_t i = 0; i < side * side; ++i) {
      Instance instance{0, kIdentityPose};
      const std::uint32_t at[2] = {i % side, i / side};
      for (int k = 0; k < 2; ++k) {
        const double moved = layer == 0 ? 0 : random.between(-jitter, jitter);
        instance.pose.translation[k] = length[k] * (at[k] + moved);
      }
      // The floor's upper side is the plane z = 0.
      instance.pose.translation[2] = -bounds.upper[2] + layer * (length[2] - sink);
      stack.add(instance, layer == 0 ? Motion::fixed : Motion::moving);
    }
  }
  return stack;
}

Configuration unstructured_pile(const AssetView& body, const AssetView& ground, std::uint32_t count,
                                std::uint64_t seed) {
  constexpr double kClosest = 0.55, kWider = 1.1;  // of the diagonal, at which no two can touch
  const AssetView assets[] = {body};
  ContactQuery query;
  if (query.set_assets(assets) != Status::kOk) throw std::bad_alloc();
  Random random(seed);
  std::vector<Instance> bodies(count);
  double spacing = kClosest * bounds_of(body).diagonal();
  while (!spread(Lattice(body, bounds_of(ground), count, spacing), query, random, bodies)) spacing *= kWider;
  Configuration pile;
  pile.add({1, kIdentityPose}, Motion::fixed);
  for (const Instance& instance : bodies) pile.add(instance, Motion::moving);
  return pile;
}

Configuration rock_slide(const AssetView& body, const AssetView& ground, std::uint32_t count, double tilt,
                         std::uint64_t seed) {
  Configuration slide;
  for (const Instance& instance : bench::make_slide(body, ground, count, tilt, {seed, {}})) {
    slide.add(instance, instance.asset == 1 ? Motion::fixed : Motion::moving);
  }
  return slide;
}

}  // namespace tandem::simulation
