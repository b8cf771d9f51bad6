#pragma once
#include <cstdint>
#include <span>
#include <vector>

#include "dynamics/simulation.h"
#include "tandem/dynamics/world.h"
#include "tandem/kernels/excluded_pairs.h"

namespace tandem::dynamics {

/// What a world is made of, as a simulation takes it.
struct WorldSetup {
  std::vector<BodyProperties> properties;
  std::vector<BodyState> states;
  std::vector<std::uint32_t> group, mask, world;  ///< of each body, see PairFilter
  std::vector<Joint> joints;
  SimulationOptions options;
};

/// Makes it of what World::set_bodies() is given. Result: what that names, and `where` is the body or joint.
/// Throws std::bad_alloc.
Status set_up(std::span<const AssetView> assets, std::span<const BodyDescription> bodies,
              const WorldOptions& options, std::span<const JointDescription> joints, WorldSetup& setup,
              std::uint64_t& where);

/// Makes the table of pairs that do not meet: those that are excluded, or joined and may not touch. Result:
/// as of ExcludedPairTable::set(). Throws std::bad_alloc.
Status exclude_joined(std::span<const ObjectPair> excluded, std::span<const Joint> joints,
                      ExcludedPairTable& table);

/// Returns whether a body may have these numbers.
bool is_usable(const BodySettings& body);

/// Result: kOk; kUnknownInstance, kJoinsNothing, kBadJoint or kNoAxis.
Status check(const JointDescription& joint, std::span<const BodyProperties> bodies);

}  // namespace tandem::dynamics
