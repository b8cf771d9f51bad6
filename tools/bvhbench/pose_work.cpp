#include "pose_work.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstring>
#include <limits>
#include <new>

#include "parallel/parallel.h"
#include "statistics/oriented_work.h"
#include "tandem/formats/hash.h"

namespace tandem::bench {
namespace {

// Two bodies, the first at the identity, asked about pose after pose.
class PairQuery {
 public:
  PairQuery(const NamedAsset& a, const NamedAsset& b) : path_(b.path) {
    const AssetView assets[] = {a.view, b.view};
    check(scene_.set_assets(assets));
  }

  const ContactCounters& ask(const Pose& pose_of_b, bool first_contact_only) {
    const Instance instances[] = {{0, kIdentityPose}, {1, pose_of_b}};
    const ObjectPair pair = {0, 1};
    ContactOptions options;
    options.first_contact_only = first_contact_only;
    check(scene_.place(instances));
    check(query_.find(scene_, {&pair, 1}, options));
    return query_.counters();
  }

 private:
  void check(Status status) const {
    if (status == Status::kOutOfMemory) throw std::bad_alloc();
    if (status != Status::kOk) throw FileError(path_ + ": " + explain(status));
  }

  std::string path_;
  Scene scene_;
  ContactQuery query_;
};

// Calls work(query, i) for each i below count, on all threads.
template <typename Work>
void for_each_pose(const NamedAsset& a, const NamedAsset& b, std::size_t count, const Work& work) {
  parallel::for_each(
      count, [&] { return PairQuery(a, b); }, work);
}

std::uint32_t narrowed(std::uint64_t counter) {
  if (counter > std::numeric_limits<std::uint32_t>::max()) throw std::length_error("a counter beyond 2^32");
  return static_cast<std::uint32_t>(counter);
}

// Returns a quantile of sorted values.
double quantile(const std::vector<std::uint32_t>& sorted, double part) {
  const double at = part * static_cast<double>(sorted.size() - 1);
  const auto below = static_cast<std::size_t>(at);
  const auto above = std::min(below + 1, sorted.size() - 1);
  return sorted[below] + (at - static_cast<double>(below)) * (double{1} * sorted[above] - sorted[below]);
}

double mean_of(std::span<const std::uint32_t> values) {
  double sum = 0;
  for (const std::uint32_t value : values) sum += value;
  return sum / static_cast<double>(values.size());
}

// Returns the standard error of a mean from the sum of the squares of its values' residuals.
double standard_error(double squares, std::size_t count) {
  const auto n = static_cast<double>(count);
  return count > 1 ? std::sqrt(squares / (n - 1) / n) : NAN;
}

}  // namespace

std::vector<NearContactPose> make_poses(const NamedAsset& a, const NamedAsset& b, std::uint32_t count,
                                        std::uint64_t seed, PoseSet set) {
  const NearContactPoses near_contact(bounds_of(a.view), bounds_of(b.view), seed, set);
  std::vector<std::optional<NearContactPose>> found(count);
  for_each_pose(a, b, count, [&](PairQuery& query, std::size_t i) {
    found[i] = near_contact.find(i, [&](const Pose& pose) { return query.ask(pose, true).contacts > 0; });
  });
  std::vector<NearContactPose> poses;
  for (const auto& pose : found) {
    if (!pose) throw FileError(b.path + ": no pose in contact with " + a.path + " was found");
    poses.push_back(*pose);
  }
  return poses;
}

PoseWork measure_poses(const NamedAsset& a, const NamedAsset& b, std::span<const Pose> poses) {
  PoseWork work;
  for (auto* column : {&work.block_pairs, &work.candidates, &work.contacts, &work.oriented_block_pairs,
                       &work.oriented_candidates})
    column->resize(poses.size());
  const OrientedWork on_gpu(a.view, b.view);
  std::atomic<bool> oriented = true;
  for_each_pose(a, b, poses.size(), [&](PairQuery& query, std::size_t i) {
    const ContactCounters& counters = query.ask(poses[i], false);
    work.block_pairs[i] = narrowed(counters.block_pairs);
    work.candidates[i] = narrowed(counters.candidates);
    work.contacts[i] = narrowed(counters.contacts);
    if (const std::optional<WalkWork> walk = on_gpu.count(poses[i])) {
      work.oriented_block_pairs[i] = narrowed(walk->block_pairs);
      work.oriented_candidates[i] = narrowed(walk->candidates);
    } else {
      oriented = false;
    }
  });
  if (!oriented) {
    work.oriented_block_pairs.clear();
    work.oriented_candidates.clear();
  }
  return work;
}

std::uint64_t geometry_hash(const AssetView& asset) {
  const LevelView level = asset.level();
  std::vector<std::uint64_t> hashes(level.triangle_count);
  for (std::uint32_t i = 0; i < level.triangle_count; ++i) {
    float corners[3][3];
    for (int k = 0; k < 3; ++k) std::copy_n(level.triangles[i].corner[k].position, 3, corners[k]);
    hashes[i] = xxh64(corners, sizeof corners);
  }
  std::sort(hashes.begin(), hashes.end());
  hashes.resize(hashes.size() + 3);
  std::memcpy(&hashes[level.triangle_count], asset.header->origin, 3 * sizeof(double));
  return xxh64(hashes.data(), hashes.size() * sizeof hashes[0]);
}

Spread spread_of(std::span<const std::uint32_t> values) {
  std::vector<std::uint32_t> sorted(values.begin(), values.end());
  std::sort(sorted.begin(), sorted.end());
  const double mean = mean_of(values);
  double squares = 0;
  for (const std::uint32_t value : values) squares += (value - mean) * (value - mean);
  return {mean, standard_error(squares, values.size()), quantile(sorted, 0.25), quantile(sorted, 0.5),
          quantile(sorted, 0.75)};
}

Ratio ratio_of(std::span<const std::uint32_t> values, std::span<const std::uint32_t> base) {
  const double base_mean = mean_of(base), ratio = mean_of(values) / base_mean;
  if (base.empty() || base_mean == 0) return {NAN, NAN};
  double squares = 0;
  for (std::size_t i = 0; i < values.size(); ++i) {
    const double rest = values[i] - ratio * base[i];
    squares += rest * rest;
  }
  return {ratio, standard_error(squares, values.size()) / base_mean};
}

}  // namespace tandem::bench
