#pragma once
#include <algorithm>
#include <cmath>
#include <span>
#include <vector>

#include "dynamics/contact_finder.h"
#include "dynamics/rigid_body.h"
#include "dynamics/threads.h"
#include "tandem/kernels/impact_query.h"

namespace tandem::dynamics {

/// Returns whether a body moves so far in a step that it may pass through others: one of its points by more
/// than half the inner radius of the thinnest closed shape, which is half the least side of its bounds.
TANDEM_HD inline bool is_fast(const BodyProperties& body, const BodyState& before, const BodyState& after,
                              double thinnest) {
  constexpr double kFast = 0.5;
  if (body.motion == Motion::fixed) return false;
  const double way = norm(after.position - before.position) +
                     body.radius * norm(turn_between(before.orientation, after.orientation));
  return way > kFast * thinnest;
}

/// Returns the least inner radius of the bodies' shapes.
inline double thinnest_of(std::span<const BodyProperties> bodies, std::span<const double> inner_radii) {
  double thinnest = INFINITY;
  for (const BodyProperties& body : bodies) thinnest = std::min(thinnest, inner_radii[body.shape]);
  return thinnest;
}

/// Keeps fast bodies from passing through others in a step: they are carried to where they first meet
/// another body, a slop deep, so that the next step has a contact there and stops them. Where two touch
/// already they go on until they are deeper in each other by a part of the thinner one's inner radius. What
/// is left of the step's way is lost. Velocities are those of the time of impact; of bodies that touched
/// already, and that contacts did not hold, they are lost with the way, so that no energy comes of it.
///
/// Bodies that joints hold together stop together, at the first impact of any of them, and lose velocities
/// together, so that their anchors come apart by no more than by what bodies turn in the step.
///
/// See is_fast(). Steps without a fast body cost next to nothing.
class ContinuousMotion {
 public:
  /// What the shapes and the filter look at, and the filter, must outlive this. filter: names the pairs that
  /// may meet, or null; its motions are not looked at, and what it excludes may change between calls. Throws
  /// QueryFailed where a shape cannot be taken.
  ContinuousMotion(std::span<const AssetView> shapes, const Threads& threads,
                   const PairFilter* filter = nullptr);

  /// Takes back what of the way from `before` to `after` leads through other bodies. joined: the bodies of
  /// each joint; kNoIndex is the world. Throws QueryFailed where a query fails.
  void limit(std::span<const BodyProperties> bodies, std::span<const ObjectPair> joined,
             std::span<const BodyState> before, std::span<BodyState> after, double slop);

 private:
  double inner_radius(const BodyProperties& body) const { return inner_radius_[body.shape]; }
  bool find_fast(std::span<const BodyProperties> bodies, std::span<const BodyState> before,
                 std::span<const BodyState> after);
  void find_groups(std::span<const BodyProperties> bodies, std::span<const ObjectPair> joined);
  bool stop(std::span<const BodyProperties> bodies, std::span<const BodyState> before, double slop);
  double stop_after(const Impact& impact, std::span<const BodyProperties> bodies,
                    std::span<const BodyState> before, const ObjectPair& pair, double reach, double slop);
  double stop_of_touching(std::span<const BodyProperties> bodies, std::span<const BodyState> before,
                          const ObjectPair& pair, double first, double reach, double slop);
  double depth_at(std::span<const BodyProperties> bodies, std::span<const BodyState> before,
                  const ObjectPair& pair, double part);

  const PairFilter* filter_;
  Threads threads_;
  Scene moving_, two_;  // all bodies, and two of them
  ImpactQuery query_;
  ContactQuery contacts_;
  ManifoldQuery manifolds_;
  std::vector<double> inner_radius_;  // of each shape; infinite where it is not closed

  std::vector<Motion> fast_;          // moving: fast; fixed: not
  std::vector<Vector3> turn_;         // of each body, in the whole step
  std::vector<Vector3> way_;          // of its centre of mass
  std::vector<double> part_, stop_;   // of both, that it goes; and of that, in a round
  std::vector<double> held_;          // the least such part of a pair that touches already
  std::vector<std::uint32_t> group_;  // the first of the bodies that joints hold together with each
  std::vector<Instance> instances_;
  std::vector<RigidMotion> motion_;
};

}  // namespace tandem::dynamics
