#pragma once
#include <cstdint>
#include <span>
#include <vector>

#include "bvhbench/engines/engine.h"
#include "bvhbench/simulator/contact_point.h"
#include "tandem/kernels/manifold_query.h"

namespace tandem::simulation {

struct ContactPointOptions {
  std::uint32_t points_per_patch = kMostManifoldPoints;  ///< at most, from 1
  std::uint32_t threads = 1;
};

/// What became of a list of triangle pairs.
struct ContactStatistics {
  ManifoldCounters counters;
  double area = 0;   ///< of all manifolds, seen along their normals
  double depth = 0;  ///< the largest
};

/// Makes contact points of pairs of triangles that meet, by the library's ManifoldQuery. The same bytes on
/// every run, for any number of threads. Throws EngineError where it fails.
class ContactGenerator {
 public:
  /// Names the shapes that bodies refer to, the list given to the engine. What the views look at must outlive
  /// the generator's use.
  void set_shapes(std::span<const AssetView> shapes);

  /// The points come by ascending pair of bodies, those of the pairs `left_out` not at all. Valid until the
  /// next call. Conditions: `found` is an engine's answer for these bodies; left_out is ascending.
  const std::vector<ContactPoint>& generate(const ContactList& found, std::span<const BodyPose> bodies,
                                            std::span<const BodyPair> left_out,
                                            const ContactPointOptions& options = {});

  /// Of the last call.
  const ContactStatistics& statistics() const { return statistics_; }

 private:
  ManifoldQuery manifolds_;
  std::vector<Contact> contacts_;
  std::vector<ContactPoint> points_;
  ContactStatistics statistics_;
};

}  // namespace tandem::simulation
