#include "meshing.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "exact_predicates.h"
#include "parallel/parallel.h"
#include "tandem/formats/box.h"

namespace tandem::build {
namespace {

bool all_single(const TriangleMesh& mesh) {
  return std::all_of(mesh.points.begin(), mesh.points.end(), [](const Point& p) {
    return std::all_of(p.begin(), p.end(), [](double x) { return double{static_cast<float>(x)} == x; });
  });
}

struct Box {
  Point centre{};
  Point half{};
};

/// Halves are taken before they are added: no overflow.
Box bounding_box(const TriangleMesh& mesh) {
  Point low;
  Point high;
  low.fill(std::numeric_limits<double>::infinity());
  high.fill(-std::numeric_limits<double>::infinity());
  for (const Point& p : mesh.points)
    for (int k = 0; k < 3; ++k) {
      low[k] = std::min(low[k], p[k]);
      high[k] = std::max(high[k], p[k]);
    }
  Box box;
  for (int k = 0; k < 3; ++k) {
    box.centre[k] = low[k] / 2 + high[k] / 2;
    box.half[k] = high[k] / 2 - low[k] / 2;
  }
  return box;
}

/// Returns where to move the origin along one axis. H = `longest`, the half extent of the longest axis; c =
/// the centre.
///
/// |c| <= H: coordinates are at most 2H in magnitude and would still be about H after a move; one bit at
/// best, so stay.
///
/// Else o = c rounded to a multiple of G = 2^floor(log2 H) / 16, which lies in (H/32, H/16].
/// The move costs next to nothing: |o - c| <= G/2, so |v - o| <= H (1 + 1/32).
/// v - o stays exact in float64 wherever it can be:
/// - o/2 <= v <= 2o: exact whatever o is (Sterbenz's lemma). That is all v unless the box nearly reaches
/// zero.
/// - otherwise let q be the lowest bit set in v. If q <= G, v - o is a multiple of q because o is one of G: o
/// adds no bit
///   below those of v, and v - o is inexact only if |v - o| >= 2^53 q, when no float64 could hold it. If q >
///   G, v - o is a multiple of G, and |v - o| <= H (1 + 1/32) < 33 G is far below 2^53 G: exact.
/// An H of a few last bits of c makes G meaningless (c / G infinite or too large to round): then o = c and
/// Sterbenz holds. No overflow: with h the half extent here, |v - o| <= h + G/2 <= (kMaxCoordinate - |c|) +
/// H/32 < kMaxCoordinate because |c| > H.
double axis_origin(double centre, double longest) {
  if (std::abs(centre) <= longest) return 0;
  const double grid = longest > 0 ? std::scalbn(1.0, std::ilogb(longest) - 4) : 0;
  const double steps = centre / grid;
  return std::abs(steps) < 0x1p53 ? std::nearbyint(steps) * grid : centre;
}

Point choose_origin(const TriangleMesh& mesh) {
  if (all_single(mesh)) return {};
  const Box box = bounding_box(mesh);
  const double longest = *std::max_element(box.half.begin(), box.half.end());
  return {axis_origin(box.centre[0], longest), axis_origin(box.centre[1], longest),
          axis_origin(box.centre[2], longest)};
}

/// |stored - (v - o)|. With d = v - o rounded, e its rounding error (Knuth's two-difference, exact), d -
/// stored is exact: it is a multiple of the last bit of d and at most half a last bit of `stored`, so it fits
/// in 53 bits.
double rounding_error(double v, double o, float stored) {
  const double d = v - o;
  const double o_used = v - d;
  const double e = (v - (d + o_used)) + (o_used - o);
  return std::abs((d - double{stored}) + e);
}

void round_points(const TriangleMesh& mesh, StoredMesh& out) {
  out.points.resize(mesh.points.size());
  for (std::size_t i = 0; i < mesh.points.size(); ++i)
    for (int k = 0; k < 3; ++k) {
      const double v = mesh.points[i][k];
      const float stored = static_cast<float>(v - out.origin[k]);
      out.points[i][k] = stored;
      out.largest_rounding_error =
          std::max(out.largest_rounding_error, rounding_error(v, out.origin[k], stored));
    }
}

// A pose is looked at for its shape alone, so what float32 cannot hold may come to lie at its limit.
std::vector<std::array<float, 3>> rounded_pose(const std::vector<Point>& pose, const Point& origin) {
  std::vector<std::array<float, 3>> out(pose.size());
  for (std::size_t i = 0; i < pose.size(); ++i) {
    for (std::size_t k = 0; k < 3; ++k) {
      constexpr double kMost = double{kMaxCoordinate};
      out[i][k] = static_cast<float>(std::clamp(pose[i][k] - origin[k], -kMost, kMost));
    }
  }
  return out;
}

Point widened(const std::array<float, 3>& p) {
  return {p[0], p[1], p[2]};
}

std::uint64_t count_flat(const StoredMesh& mesh) {
  const auto count = [&](std::uint64_t& flat, std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      const TriangleIndices& t = mesh.triangles[i];
      flat += collinear(widened(mesh.points[t[0]]), widened(mesh.points[t[1]]), widened(mesh.points[t[2]]));
    }
  };
  const auto add = [](std::uint64_t& sum, std::uint64_t other) { sum += other; };
  return parallel::reduce(mesh.triangles.size(), kTrianglesAtOnce, std::uint64_t{0}, count, add);
}

}  // namespace

StoredMesh to_single_precision(TriangleMesh& mesh, CleanReport& report) {
  StoredMesh out;
  out.origin = choose_origin(mesh);
  round_points(mesh, out);
  for (const auto& pose : mesh.poses) out.poses.push_back(rounded_pose(pose, out.origin));
  mesh.points = {};
  mesh.poses = {};
  out.triangles = std::move(mesh.triangles);
  out.face = std::move(mesh.face);
  out.source_vertex = std::move(mesh.source_vertex);
  mesh.triangles = {};
  mesh.face = {};
  mesh.source_vertex = {};
  if (out.largest_rounding_error > 0) report.triangles_flattened += count_flat(out);
  return out;
}

}  // namespace tandem::build
