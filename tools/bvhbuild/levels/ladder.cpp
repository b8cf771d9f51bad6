#include "ladder.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <optional>

#include "collapses.h"
#include "common/real_from_text.h"
#include "levels/hausdorff.h"
#include "levels/nearest_triangle.h"
#include "parallel/parallel.h"
#include "tandem/formats/file.h"

namespace tandem::build {

namespace {

std::optional<LevelError> parse(std::string_view word) {
  const bool of_diagonal = word.ends_with('%');
  if (of_diagonal) word.remove_suffix(1);
  double value = 0;
  const auto [end, error] = real_from_text(word.data(), word.data() + word.size(), value);
  if (error != std::errc() || end != word.data() + word.size()) return std::nullopt;
  if (!std::isfinite(value) || !(value > 0)) return std::nullopt;
  return LevelError{of_diagonal ? value / 100 : value, of_diagonal};
}

// A level as it lies in a file, as far as distances from it need it: blocks, corners and the numbers of
// vertices. The tree must outlive it.
class LaidLevel {
 public:
  LaidLevel(const Geometry& geometry, const Tree& tree) : tree_(tree) {
    std::vector<std::uint32_t> number(geometry.points.size(), kNoIndex);
    triangles_.reserve(tree.order.size());
    topology_.reserve(tree.order.size());
    for (const std::uint32_t source : tree.order) {
      Triangle& triangle = triangles_.emplace_back(Triangle{});
      TriangleTopology& topology = topology_.emplace_back(TriangleTopology{});
      for (std::size_t k = 0; k < 3; ++k) {
        const std::uint32_t point = geometry.triangles[source][k];
        std::copy_n(geometry.points[point].data(), 3, triangle.corner[k].position);
        if (number[point] == kNoIndex) number[point] = vertex_count_++;
        topology.vertex[k] = number[point];
      }
    }
  }

  LevelView view() const {
    LevelView view;
    view.blocks = tree_.blocks.data();
    view.triangles = triangles_.data();
    view.topology = topology_.data();
    view.block_count = static_cast<std::uint32_t>(tree_.blocks.size());
    view.triangle_count = static_cast<std::uint32_t>(triangles_.size());
    view.leaf_block_count = tree_.leaf_block_count;
    view.depth = tree_.depth;
    view.vertex_count = vertex_count_;
    return view;
  }

 private:
  const Tree& tree_;
  std::vector<Triangle> triangles_;
  std::vector<TriangleTopology> topology_;
  std::uint32_t vertex_count_ = 0;
};

// The simplifier may use these parts of the wanted error, at first and where that turns out to be too much:
// the surface is farther off between the points that it looks at than in them.
constexpr double kFirstShare = 0.85, kNextShare = 0.97, kUsedUp = 0.88;
constexpr int kTries = 3;
// Counts of triangles this close are the same to a search.
constexpr double kNarrow = 1.02;

// A mesh and a bound of its distance from the finest level; no triangles: there is none.
struct Candidate {
  LevelMesh mesh;
  double error_bound = 0;
};

// Makes meshes near the finest level and measures how near they are.
class Search {
 public:
  // Makes no further meshes once `stop` is set.
  Search(const FinestLevel& finest, const OpenedMesh& opened, const std::atomic<bool>& stop)
      : finest_(finest.geometry, finest.tree), opened_(opened), stop_(stop) {}

  // A mesh of few triangles whose bound is at most `wanted`. The simplifier keeps what it looks at within a
  // distance, and the bound says what became of the rest: where it is too far off, once more with less.
  Candidate level(double wanted) const {
    double distance = kFirstShare * wanted, refused = 0;
    std::vector<Collapse> collapses;
    Candidate best;
    for (int i = 0; i < kTries && !stop_; ++i) {
      collapses = collapse_edges(opened_, finest_.view(), distance);
      Candidate candidate = {after(opened_, collapses), 0};
      candidate.error_bound = bound(candidate.mesh).upper;
      if (candidate.error_bound > wanted) {
        refused = distance;
        distance *= kNextShare * wanted / candidate.error_bound;
        continue;
      }
      const bool used_up = refused == 0 || candidate.error_bound > kUsedUp * wanted;
      if (best.mesh.triangles.empty() || candidate.mesh.triangles.size() < best.mesh.triangles.size())
        best = std::move(candidate);
      if (used_up) break;
      distance = std::sqrt(distance * refused);
    }
    return best.mesh.triangles.empty() ? longest_near(collapses, wanted) : best;
  }

  // The triangles of the finest level, in leaf order, that are nearest to the middles of a mesh's.
  std::vector<std::uint32_t> nearest(const LevelMesh& mesh) const {
    std::vector<std::uint32_t> nearest(mesh.triangles.size());
    parallel::for_parts(nearest.size(), 64, [&](std::size_t begin, std::size_t end) {
      for (std::size_t t = begin; t != end; ++t) nearest[t] = nearest_to(mesh, t);
    });
    return nearest;
  }

 private:
  std::uint32_t nearest_to(const LevelMesh& mesh, std::size_t triangle) const {
    levels::Point sum = {};
    for (const std::uint32_t corner : mesh.triangles[triangle]) {
      const auto& point = mesh.points[corner];
      sum = levels::plus(sum, levels::Point{{point[0], point[1], point[2]}});
    }
    const levels::Point middle = levels::scaled(1.0 / 3, sum);
    return levels::nearest_triangle(finest_.view(), middle, mesh.was[triangle]).triangle;
  }

  // The mesh after as many of the collapses as leave it near enough, or nearly as many.
  Candidate longest_near(const std::vector<Collapse>& collapses, double wanted) const {
    const auto triangles = [&](std::size_t count) {
      return static_cast<double>(count == 0 ? opened_.triangles.size() : collapses[count - 1].triangles);
    };
    std::size_t near = 0, far = collapses.size();
    Candidate best;
    while (!stop_ && near + 1 < far &&
           triangles(near) > std::max(kNarrow * triangles(far), triangles(far) + 4)) {
      const double most = std::sqrt(triangles(near) * triangles(far));
      const auto middle = std::partition_point(collapses.begin(), collapses.end(),
                                               [&](const Collapse& c) { return c.triangles > most; });
      const auto count =
          std::clamp(static_cast<std::size_t>(middle - collapses.begin()) + 1, near + 1, far - 1);
      Candidate candidate = {after(opened_, std::span(collapses).first(count)), 0};
      candidate.error_bound = bound(candidate.mesh, wanted).upper;
      if (candidate.error_bound <= wanted) {
        near = count;
        best = std::move(candidate);
      } else {
        far = count;
      }
    }
    if (near > 0) best.error_bound = std::min(best.error_bound, bound(best.mesh).upper);
    return best;
  }

  // `wanted`: as far as it takes to know whether the mesh is near enough. A mesh of nothing, where all
  // corners round together, never is.
  HausdorffBound bound(const LevelMesh& mesh, std::optional<double> wanted = {}) const {
    if (mesh.triangles.empty()) return {};
    const Geometry geometry = {mesh.points, mesh.triangles};
    const Tree tree = build_tree(geometry, Imaginary::minimal, Effort::fast);
    HausdorffOptions options;
    options.wanted = wanted;
    options.most_looks = (1 << 18) + 256 * (finest_.view().triangle_count + mesh.triangles.size());
    return hausdorff_bound(finest_.view(), LaidLevel(geometry, tree).view(), options);
  }

  LaidLevel finest_;
  const OpenedMesh& opened_;
  const std::atomic<bool>& stop_;
};

}  // namespace

std::string parse_level_errors(const std::string& text, std::vector<LevelError>& errors) {
  errors.clear();
  if (text == "auto") {
    errors = {{0.001, true}, {0.003, true}, {0.01, true}, {0.03, true}};
    return {};
  }
  double largest[2] = {};  // of lengths, of shares
  for (std::size_t begin = 0; begin <= text.size();) {
    const std::size_t end = std::min(text.find(',', begin), text.size());
    const std::string word = text.substr(begin, end - begin);
    const std::optional<LevelError> error = parse(word);
    if (!error)
      return "'" + word + "' is no error of a level: auto, or positive numbers, each with % or without";
    double& before = largest[error->of_diagonal ? 1 : 0];
    if (!(error->value > before)) return "'" + word + "' is not larger than the error before: errors ascend";
    before = error->value;
    errors.push_back(*error);
    begin = end + 1;
  }
  if (errors.size() < kMaxLevels) return {};
  return std::to_string(errors.size()) + " levels: a file has room for " + std::to_string(kMaxLevels - 1) +
         " beside the finest";
}

std::string name(const LevelError& error) {
  char text[40];
  const double value = error.of_diagonal ? error.value * 100 : error.value;
  const int digits = std::snprintf(text, sizeof text, "%.6g", value);
  return std::string(text, static_cast<std::size_t>(digits)) + (error.of_diagonal ? "%" : "");
}

Ladder make_ladder(const FinestLevel& finest, std::span<const double> wanted, OptimisationWatch& watch) {
  Ladder ladder;
  const OpenedMesh opened = cut_open(finest.geometry, finest.tree, finest.topology);
  ladder.fixed_vertices = opened.fixed_vertices;
  if (opened.triangles.empty()) {  // segments and points only
    for (std::size_t i = 0; i < wanted.size(); ++i) ladder.left_out.push_back({i, NoLevel::no_coarser});
    return ladder;
  }
  const Search search(finest, opened, watch.stop);
  std::size_t triangles = finest.geometry.triangles.size();
  for (std::size_t i = 0; i < wanted.size(); ++i) {
    watch.reach(static_cast<double>(i) / static_cast<double>(wanted.size()));
    Candidate candidate = search.level(wanted[i]);
    if (candidate.mesh.triangles.empty() || candidate.mesh.triangles.size() >= triangles) {
      ladder.left_out.push_back({i, watch.stop ? NoLevel::interrupted : NoLevel::no_coarser});
      continue;
    }
    // A level that is coarser and nearer spares the ones before it.
    while (!ladder.levels.empty() && ladder.levels.back().error_bound > candidate.error_bound) {
      ladder.left_out.push_back({ladder.levels.back().wanted, NoLevel::spared});
      ladder.levels.pop_back();
    }
    triangles = candidate.mesh.triangles.size();
    std::vector<std::uint32_t> nearest = search.nearest(candidate.mesh);
    for (std::uint32_t& triangle : nearest) triangle = finest.tree.order[triangle];
    ladder.levels.push_back({std::move(candidate.mesh), std::move(nearest), i, candidate.error_bound});
  }
  std::sort(ladder.left_out.begin(), ladder.left_out.end(),
            [](const LeftOutError& a, const LeftOutError& b) { return a.wanted < b.wanted; });
  return ladder;
}

}  // namespace tandem::build
