#pragma once
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "query_scenes.h"
#include "tandem/kernels/contact_query.h"
#include "tandem/kernels/containment_query.h"
#include "tandem/kernels/manifold_query.h"

/// Seeded scenes of any meshes, and all that a step of a simulation finds in them.
namespace tandem::test {

/// Bodies that heap up, just touch, coincide, stand face to face or lie within each other, at the origin or
/// far from it, over three steps: after the first they move by a thousandth of their size or rest, after the
/// second some are gone.
struct RandomScene {
  const char* kind;
  std::vector<std::vector<Instance>> steps;
};

/// The scene of a seed, of one or several of these meshes whose sizes suit. Five successive seeds make a
/// scene of each kind. Throws std::runtime_error where a query fails. Condition: there are meshes.
RandomScene random_scene(std::span<const AssetView> meshes, std::uint64_t seed);

/// Closed and open meshes, one far from its origin, and triangles that cross, coincide or are flat.
SampleAssets sample_meshes();

/// Holds what a step finds.
struct Detected {
  std::vector<ObjectPair> pairs;
  std::vector<Contact> contacts;  ///< sorted
  std::vector<Manifold> manifolds;
  std::vector<ManifoldPoint> points;
  ManifoldCounters counters;
  std::vector<Containment> contained;
};

/// How many points have a `previous` one.
std::size_t points_found_again(const Detected& found);

/// Throws std::runtime_error unless it is kOk.
void require(Status status, const char* step);

void sort(std::vector<Contact>& contacts);

/// Goes on from step to step on the CPU. Functions throw std::runtime_error where a call fails.
class CpuDetection {
 public:
  explicit CpuDetection(std::span<const AssetView> meshes, std::uint32_t threads = 1);
  Detected step(std::span<const Instance> instances);

 private:
  Scene scene_;
  ContactQuery query_;
  ManifoldQuery manifolds_;
  ContainmentQuery containment_;
};

/// Says which list first differs, in a byte, and where. The text is empty where none does.
std::string first_difference(const Detected& x, const Detected& y);

/// Says what of docs/contacts.md does not hold of a step. The text is empty where all of it holds. before:
/// the step before, or nothing.
std::string first_defect(std::span<const Instance> instances, const Detected& found, const Detected& before);

}  // namespace tandem::test
