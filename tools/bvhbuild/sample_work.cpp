#include "sample_work.h"

#include <algorithm>
#include <cmath>
#include <span>

#include "bvhbuild/tree/assemble.h"
#include "common/random_pose.h"
#include "statistics/statistics.h"
#include "tandem/formats/check.h"

namespace tandem::build {
namespace {

constexpr int kPoses = 32;

// Poses of the mesh against itself, each of which brings a corner of some triangle to one of another and
// turns the mesh at random about it. They depend on the triangles and not on a tree.
std::vector<Pose> touching_poses(const Geometry& geometry) {
  Random random(1);
  const auto corner = [&] {
    const auto triangle =
        static_cast<std::size_t>(random.between(0, static_cast<double>(geometry.triangles.size())));
    const auto& point =
        geometry.points[geometry.triangles[std::min(triangle, geometry.triangles.size() - 1)][0]];
    return Vector{point[0], point[1], point[2]};
  };
  std::vector<Pose> poses;
  for (int i = 0; i < kPoses; ++i) {
    const Rotation rotation = random_rotation(random);
    const Vector from = corner(), to = corner();
    poses.push_back(place(0, rotation, from, to).pose);
  }
  return poses;
}

// Returns the mean block pairs in these poses; none where the tree takes too many.
std::optional<double> block_pairs_of(const Geometry& geometry, const Tree& tree,
                                     std::span<const Pose> poses) {
  const std::vector<std::uint32_t> face(geometry.triangles.size(), 0);
  const SourcePart whole = {{}, {}, 0, 1};
  AssetSource source;
  source.source_faces = 1;
  source.parts = {&whole, 1};
  source.provenance = "{}";
  const AssetLevel level{geometry, face, &tree, {}, 0};
  const CheckedImage file = assemble_checked(source, {&level, 1});
  return mean_block_pairs(file.asset, poses);
}

}  // namespace

std::vector<SampleWork> measure_samples(const Geometry& geometry, const Tree& tree,
                                        const BuildOptions& options, const std::vector<std::string>& names) {
  const Effort effort = options.effort == Effort::best ? Effort::standard : options.effort;
  std::vector<SampleWork> samples;
  for (std::size_t i = 0; i <= geometry.poses.size(); ++i) {
    const Geometry here = geometry.sample(i);
    SampleWork& sample = samples.emplace_back();
    sample.name = names[i];
    const std::vector<Pose> poses = touching_poses(here);
    const auto pairs = block_pairs_of(here, refitted(here, tree), poses);
    const auto own_pairs = block_pairs_of(here, build_tree(here, options.imaginary, effort), poses);
    if (pairs && own_pairs) sample.block_pairs = pairs, sample.own_block_pairs = own_pairs;
  }
  return samples;
}

std::optional<SampleSummary> summary_of(const std::vector<SampleWork>& samples) {
  SampleSummary summary;
  double sum = 0, own_sum = 0;
  for (const SampleWork& sample : samples) {
    if (!sample.block_pairs) continue;
    sum += *sample.block_pairs;
    own_sum += *sample.own_block_pairs;
    const double ratio = *sample.block_pairs / *sample.own_block_pairs;
    if (ratio <= summary.worst_ratio) continue;
    summary.worst_ratio = ratio;
    summary.worst = sample.name;
  }
  if (own_sum == 0) return std::nullopt;
  summary.mean_ratio = sum / own_sum;
  return summary;
}

Json samples_json(const std::vector<SampleWork>& samples) {
  const auto rounded = [](double ratio) { return std::round(1e4 * ratio) / 1e4; };
  Json json = {
      {"count", samples.size()}, {"mean_ratio", nullptr}, {"worst_ratio", nullptr}, {"worst", nullptr}};
  if (const auto summary = summary_of(samples)) {
    json["mean_ratio"] = rounded(summary->mean_ratio);
    json["worst_ratio"] = rounded(summary->worst_ratio);
    json["worst"] = summary->worst;
  }
  return json;
}

}  // namespace tandem::build
