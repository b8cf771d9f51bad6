#include "ladder.h"

#include <oneapi/tbb/parallel_for.h>

#include <algorithm>
#include <cmath>

#include "collapses.h"
#include "laid_level.h"
#include "levels/hausdorff.h"
#include "levels/nearest_triangle.h"
#include "opened_mesh.h"

namespace tandem::build {
namespace {

// Counts of triangles this close are the same to a search.
constexpr double kNarrow = 1.02;
// How far a search goes at a time while it does not know both a level that is near enough and one that is
// not.
constexpr double kStride = 1.3;

// A mesh after some collapses and its distance from the finest level.
struct Candidate {
  LevelMesh mesh;
  double error_bound = 0;
};

// Looks for levels in one sequence of collapses. A prefix of it, known by its length, is a mesh.
class Search {
 public:
  Search(const FinestLevel& finest, const OpenedMesh& opened)
      : finest_(finest.geometry, finest.tree), opened_(opened), collapses_(collapse_edges(opened)) {}

  // The longest prefix, or nearly, that is near enough; at least `from`, which is.
  std::size_t longest(double wanted, std::size_t from) {
    std::size_t near = from, far = collapses_.size() + 1;
    std::size_t next = std::max(guess(wanted), near + 1);
    for (double stride = kStride; near + 1 < far; stride *= stride) {
      if (next >= far) next = far - 1;
      if (next <= near) break;
      if (is_near(next, wanted)) {
        near = next;
        if (far <= collapses_.size()) break;
        next = prefix_of(triangles(near) / stride);
      } else {
        far = next;
        if (near > from) break;
        next = prefix_of(triangles(far) * stride);
      }
    }
    while (near + 1 < far && triangles(near) > std::max(kNarrow * triangles(far), triangles(far) + 4)) {
      const std::size_t middle = prefix_of(std::sqrt(triangles(near) * triangles(far)));
      const std::size_t between = std::clamp(middle, near + 1, far - 1);
      (is_near(between, wanted) ? near : far) = between;
    }
    if (near > 0 && collapses_[near - 1].error > 0) scale_ = wanted / collapses_[near - 1].error;
    return near;
  }

  // The level of a prefix, or of one that is a little shorter, so that its bound is at most `wanted`.
  Candidate level(std::size_t prefix, double wanted) const {
    for (double shorter = 1;; shorter *= 1.01) {
      const double most = triangles(prefix) * shorter;
      const std::size_t length = most < triangles(0) ? std::min(prefix, prefix_of(most)) : 0;
      Candidate candidate = {after(opened_, std::span(collapses_).first(length)), 0};
      candidate.error_bound = bound(candidate.mesh, {}).upper;
      if (length == 0 || candidate.error_bound <= wanted) return candidate;
    }
  }

  // The triangles of the finest level, in leaf order, that are nearest to the middles of a mesh's.
  std::vector<std::uint32_t> nearest(const LevelMesh& mesh) const {
    std::vector<std::uint32_t> nearest(mesh.triangles.size());
    tbb::parallel_for(std::size_t{0}, nearest.size(), [&](std::size_t t) {
      levels::Point sum = {};
      for (const std::uint32_t corner : mesh.triangles[t]) {
        const auto& point = mesh.points[corner];
        sum = levels::plus(sum, levels::Point{{point[0], point[1], point[2]}});
      }
      const levels::Point middle = levels::scaled(1.0 / 3, sum);
      nearest[t] = levels::nearest_triangle(finest_.view(), middle, mesh.was[t]).triangle;
    });
    return nearest;
  }

  double triangles(std::size_t prefix) const {
    return prefix == 0 ? static_cast<double>(opened_.triangles.size()) : collapses_[prefix - 1].triangles;
  }

 private:
  // The shortest prefix that leaves at most so many triangles; the longest if none does.
  std::size_t prefix_of(double most) const {
    const auto after = std::partition_point(collapses_.begin(), collapses_.end(),
                                            [&](const Collapse& c) { return c.triangles > most; });
    return std::min(static_cast<std::size_t>(after - collapses_.begin()) + 1, collapses_.size());
  }

  // The longest prefix whose error is probably not above `wanted`.
  std::size_t guess(double wanted) const {
    const auto after = std::partition_point(collapses_.begin(), collapses_.end(),
                                            [&](const Collapse& c) { return c.error * scale_ <= wanted; });
    return static_cast<std::size_t>(after - collapses_.begin());
  }

  HausdorffBound bound(const LevelMesh& mesh, const HausdorffOptions& options) const {
    const Geometry geometry = {mesh.points, mesh.triangles};
    const Tree tree = build_tree(geometry, Imaginary::minimal, Effort::fast);
    return hausdorff_bound(finest_.view(), LaidLevel(geometry, tree).view(), options);
  }

  bool is_near(std::size_t prefix, double wanted) const {
    const LevelMesh mesh = after(opened_, std::span(collapses_).first(prefix));
    if (mesh.triangles.empty()) return false;
    HausdorffOptions options;
    options.wanted = wanted;
    return bound(mesh, options).upper <= wanted;
  }

  LaidLevel finest_;
  const OpenedMesh& opened_;
  std::vector<Collapse> collapses_;
  double scale_ = 0.5;  // the distance after some collapses over the last one's error, as last seen
};

}  // namespace

Ladder make_ladder(const FinestLevel& finest, std::span<const double> wanted,
                   const std::function<void(double)>& progress) {
  Ladder ladder;
  const OpenedMesh opened = cut_open(finest.geometry, finest.tree, finest.topology);
  ladder.fixed_vertices = opened.fixed_vertices;
  Search search(finest, opened);
  std::size_t prefix = 0, triangles = finest.geometry.triangles.size();
  for (std::size_t i = 0; i < wanted.size(); ++i) {
    progress(static_cast<double>(i) / static_cast<double>(wanted.size()));
    const std::size_t before = prefix;
    prefix = search.longest(wanted[i], prefix);
    Candidate candidate;
    if (prefix > before) candidate = search.level(prefix, wanted[i]);
    if (prefix == before || candidate.mesh.triangles.size() >= triangles) {
      ladder.left_out.push_back(i);
      continue;
    }
    // A level that is coarser and nearer spares the ones before it.
    while (!ladder.levels.empty() && ladder.levels.back().error_bound > candidate.error_bound) {
      ladder.left_out.push_back(ladder.levels.back().wanted);
      ladder.levels.pop_back();
    }
    triangles = candidate.mesh.triangles.size();
    std::vector<std::uint32_t> nearest = search.nearest(candidate.mesh);
    for (std::uint32_t& triangle : nearest) triangle = finest.tree.order[triangle];
    ladder.levels.push_back({std::move(candidate.mesh), std::move(nearest), i, candidate.error_bound});
  }
  std::sort(ladder.left_out.begin(), ladder.left_out.end());
  return ladder;
}

}  // namespace tandem::build
