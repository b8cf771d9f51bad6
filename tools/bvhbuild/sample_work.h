#pragma once
#include <optional>
#include <string>
#include <vector>

#include "bvhbuild/tree/tree.h"
#include "common/json.h"

namespace tandem::build {

/// Says what a tree costs in one sample of an animation, against a tree built for that sample alone.
struct SampleWork {
  std::string name;
  /// Mean block pairs of the refitted tree and of the sample's own tree; none where either takes too many.
  std::optional<double> block_pairs, own_block_pairs;
};

/// Measures the tree in each sample: by the block pairs of queries of the mesh against itself, in 32 random
/// poses in which a point of the one lies on a point of the other. names: of the samples, that of the
/// geometry's points first. The samples' own trees are built with the same options, but with no more than
/// standard effort.
std::vector<SampleWork> measure_samples(const Geometry& geometry, const Tree& tree,
                                        const BuildOptions& options, const std::vector<std::string>& names);

/// Says how many times the work of the samples' own trees a tree takes: over all samples, and in the one
/// where that is worst.
struct SampleSummary {
  double mean_ratio = 0, worst_ratio = 0;
  std::string worst;
};

/// Returns nothing where nothing could be measured.
std::optional<SampleSummary> summary_of(const std::vector<SampleWork>& samples);

/// Returns what reports and files say of the samples: docs/json.md has the keys.
Json samples_json(const std::vector<SampleWork>& samples);

}  // namespace tandem::build
