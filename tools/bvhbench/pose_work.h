#pragma once
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "bvhbench/scenes/scene_file.h"
#include "statistics/near_contact.h"

/// Poses of two bodies near contact, and what a query of each costs a tree (docs/poses.md).
namespace tandem::bench {

/// A tree and the path that it came from, for messages.
struct NamedAsset {
  std::string path;
  AssetView view;
};

/// Counts what queries did in each pose.
struct PoseWork {
  std::vector<std::uint32_t> block_pairs, candidates, contacts;
  /// The counts of a GPU (statistics/oriented_work.h). Empty where it has nothing to walk in one of the
  /// poses.
  std::vector<std::uint32_t> oriented_block_pairs, oriented_candidates;

  friend bool operator==(const PoseWork&, const PoseWork&) = default;
};

/// The first `count` poses of the set. First contact is found by exact queries, so that trees over the same
/// triangles have the same poses. Throws FileError: coordinates beyond what a query takes, or no contact
/// found.
std::vector<NearContactPose> make_poses(const NamedAsset& a, const NamedAsset& b, std::uint32_t count,
                                        std::uint64_t seed, PoseSet set);

/// Makes one exact query of a at the identity and b for each pose, and counts what a GPU would walk. Throws
/// FileError. Both use the threads that the caller may (parallel::ThreadLimit); what they find does not
/// depend on them.
PoseWork measure_poses(const NamedAsset& a, const NamedAsset& b, std::span<const Pose> poses);

/// XXH64 of level 0's triangles, corner by corner, and the origin, whatever the order of the triangles: equal
/// for trees over one mesh. Source faces and parts do not count.
std::uint64_t geometry_hash(const AssetView& asset);

/// A counter over the poses.
struct Spread {
  double mean;
  double standard_error;                          ///< of the mean; NaN of a single pose
  double lower_quartile, median, upper_quartile;  ///< linear between neighbours
};

/// Condition: at least one value.
Spread spread_of(std::span<const std::uint32_t> values);

/// The ratio of two means over the same poses, and its standard error as poses pair them (by the delta
/// method); NaN where the denominator is 0 or there is none.
struct Ratio {
  double value, standard_error;
};

/// Condition: at least one value, and as many of `base`, or none.
Ratio ratio_of(std::span<const std::uint32_t> values, std::span<const std::uint32_t> base);

}  // namespace tandem::bench
