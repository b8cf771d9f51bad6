#include "levels/hausdorff.h"

#include <algorithm>
#include <cmath>
#include <span>
#include <vector>

#include "levels/nearest_triangle.h"
#include "levels/piece.h"
#include "parallel/parallel.h"

namespace tandem {
namespace {

using namespace levels;

constexpr std::size_t kCornersAtOnce = 512, kTrianglesAtOnce = 1024, kPiecesAtOnce = 1024;

/// The farthest point that was found.
struct Farthest {
  double distance = -1;
  Point point = {};
  std::uint32_t nearest = 0;
  int side = 0;

  void offer(const Corner& corner, int of_side) {
    if (corner.distance > distance) *this = {corner.distance, corner.point, corner.nearest, of_side};
  }
  void offer(const Farthest& other) {
    if (other.distance > distance) *this = other;
  }
};

/// The distances of the corners of one surface: how far they are from the other.
struct CornerDistances {
  std::vector<double> distance;
  std::vector<std::uint32_t> nearest;
};

/// The largest magnitude of a coordinate of a level's corners.
double largest_coordinate(const LevelView& level) {
  float largest = 0;
  for (const Triangle& triangle : std::span(level.triangles, level.triangle_count)) {
    for (const auto& corner : triangle.corner) {
      for (const float x : corner.position) largest = std::max(largest, std::fabs(x));
    }
  }
  return largest;
}

/// The number under which a corner's position is known.
std::uint64_t corner_number(const LevelView& level, std::uint32_t triangle, int k) {
  return level.topology == nullptr ? 3 * std::uint64_t{triangle} + k : level.topology[triangle].vertex[k];
}

/// Corners in the order of their numbers, each as 3 triangle + k.
std::vector<std::uint64_t> first_corners(const LevelView& level) {
  std::vector<std::uint64_t> corners;
  corners.reserve(level.topology == nullptr ? 3 * std::size_t{level.triangle_count} : level.vertex_count);
  for (std::uint32_t t = 0; t < level.triangle_count; ++t) {
    for (int k = 0; k < 3; ++k) {
      if (corner_number(level, t, k) == corners.size()) corners.push_back(3 * std::uint64_t{t} + k);
    }
  }
  return corners;
}

/// The nearest of these triangles.
NearestTriangle nearest_of(const LevelView& level, const Point& p, std::span<const std::uint32_t> triangles) {
  NearestTriangle nearest = {INFINITY, triangles.front()};
  for (const std::uint32_t triangle : triangles) {
    const double square = square_distance(p, level.triangles[triangle]);
    if (square < nearest.square) nearest = {square, triangle};
  }
  return nearest;
}

/// Works on parts of [0, count) that depend on nothing else: work(part, begin, end).
template <class Work>
void for_parts(std::size_t count, std::size_t size, const Work& work) {
  parallel::for_parts(count, size,
                      [&](std::size_t begin, std::size_t end) { work(begin / size, begin, end); });
}

/// Looks for the distance of two surfaces. Side 0 are the points of a and the triangles of b.
class Search {
 public:
  Search(const LevelView& a, const LevelView& b, const HausdorffOptions& options)
      : from_{a, b}, to_{b, a}, options_(options) {
    // The largest coordinate is that of the corners, not of boxes: it is the same for any tree, so that a
    // bound that one tree led to is proved with another as well.
    for (const LevelView& level : from_) largest_ = std::max(largest_, largest_coordinate(level));
    slack_ = rounding_slack(largest_);
  }

  HausdorffBound run() {
    for (const int side : {0, 1}) measure_corners(side);
    for (const int side : {0, 1}) {
      if (!is_refuted()) collect_pieces(side);
    }
    const std::uint64_t triangles = std::uint64_t{from_[0].triangle_count} + from_[1].triangle_count;
    const std::uint64_t most = options_.most_pieces.value_or((1 << 20) + 64 * triangles);
    const std::uint64_t most_looks = options_.most_looks.value_or((1 << 20) + 1024 * triangles);
    const std::uint64_t most_waiting = (1 << 20) + 2 * triangles;
    for (int round = 0; !pool_.empty() && !is_refuted(); ++round) {
      if (pieces_ >= most || looks_ >= most_looks || pool_.size() > most_waiting) break;
      refine_some(round);
    }
    return result();
  }

 private:
  /// Says what became of some pieces.
  struct Outcome {
    Farthest farthest;
    double settled = 0;  ///< the largest bound of pieces that are done with
    std::vector<Piece> left;
    std::uint64_t pieces = 0, looks = 0;
    bool too_deep = false;
  };

  /// Bounds of pieces up to here are not looked into if a point is so far away.
  double enough(double distance) const {
    const double near = std::max(distance * (1 + options_.relative), distance + 0x1p-36 * largest_);
    return std::max(near, options_.wanted.value_or(0) * (1 - 0x1p-45)) - slack_;
  }

  bool is_refuted() const { return options_.wanted && farthest_.distance - slack_ > *options_.wanted; }

  /// Returns the point with a triangle near it, and offers it as the farthest if no triangle is nearer.
  Corner measure(int side, const Point& point, std::uint32_t hint, Farthest& farthest,
                 std::uint64_t& looks) const {
    const double near = 0x1p-48 * largest_;
    const NearestTriangle nearest = nearest_triangle(to_[side], point, hint, {near * near});
    const Corner corner = {point, std::sqrt(nearest.square), nearest.triangle};
    if (nearest.certain) farthest.offer(corner, side);
    looks += nearest.looks;
    return corner;
  }

  void measure_corners(int side) {
    const std::vector<std::uint64_t> corners = first_corners(from_[side]);
    CornerDistances& known = corners_[side];
    known.distance.resize(corners.size());
    known.nearest.resize(corners.size());
    std::vector<Farthest> farthest(corners.size() / kCornersAtOnce + 1);
    std::vector<std::uint64_t> looks(farthest.size(), 0);
    for_parts(corners.size(), kCornersAtOnce, [&](std::size_t part, std::size_t begin, std::size_t end) {
      std::uint32_t hint = 0;
      for (std::size_t i = begin; i < end; ++i) {
        const Triangle& triangle = from_[side].triangles[corners[i] / 3];
        const Point point = corner_of(triangle, static_cast<int>(corners[i] % 3));
        const Corner corner = measure(side, point, hint, farthest[part], looks[part]);
        known.distance[i] = corner.distance;
        known.nearest[i] = hint = corner.nearest;
      }
    });
    for (const Farthest& point : farthest) farthest_.offer(point);
    for (const std::uint64_t some : looks) looks_ += some;
  }

  /// The pieces that are whole triangles, as far as they are not settled.
  void collect_pieces(int side) {
    const LevelView& from = from_[side];
    const double limit = enough(farthest_.distance);
    std::vector<Outcome> outcomes(from.triangle_count / kTrianglesAtOnce + 1);
    for_parts(from.triangle_count, kTrianglesAtOnce,
              [&](std::size_t part, std::size_t begin, std::size_t end) {
                for (std::size_t t = begin; t < end; ++t) {
                  Piece piece = {{}, INFINITY, 0, 0, static_cast<std::uint8_t>(side), false};
                  for (int k = 0; k < 3; ++k) {
                    const std::uint64_t i = corner_number(from, static_cast<std::uint32_t>(t), k);
                    piece.corner[k] = {corner_of(from.triangles[t], k), corners_[side].distance[i],
                                       corners_[side].nearest[i]};
                  }
                  tighten(to_[side], {}, limit, piece);
                  settle(piece, limit, outcomes[part]);
                }
              });
    for (const Outcome& outcome : outcomes) take(outcome);
  }

  static void settle(const Piece& piece, double limit, Outcome& outcome) {
    if (piece.bound <= limit)
      outcome.settled = std::max(outcome.settled, piece.bound);
    else
      outcome.left.push_back(piece);
  }

  void take(const Outcome& outcome) {
    farthest_.offer(outcome.farthest);
    settled_ = std::max(settled_, outcome.settled);
    pool_.insert(pool_.end(), outcome.left.begin(), outcome.left.end());
    pieces_ += outcome.pieces;
    looks_ += outcome.looks;
    too_deep_ = too_deep_ || outcome.too_deep;
  }

  /// Looks into the pieces with the largest bounds, and into what is left of each of them a few times.
  void refine_some(int round) {
    const std::size_t count = std::min(pool_.size(), kPiecesAtOnce);
    const auto larger = [](const Piece& x, const Piece& y) { return x.bound > y.bound; };
    std::nth_element(pool_.begin(), pool_.begin() + static_cast<std::ptrdiff_t>(count - 1), pool_.end(),
                     larger);
    const std::vector<Piece> chosen(pool_.begin(), pool_.begin() + static_cast<std::ptrdiff_t>(count));
    pool_.erase(pool_.begin(), pool_.begin() + static_cast<std::ptrdiff_t>(count));
    std::vector<Outcome> outcomes(count);
    const std::uint64_t times = 4u << std::min(round, 4);
    for_parts(count, 8, [&](std::size_t, std::size_t begin, std::size_t end) {
      for (std::size_t i = begin; i < end; ++i) refine(chosen[i], times, outcomes[i]);
    });
    for (const Outcome& outcome : outcomes) take(outcome);
  }

  void refine(const Piece& whole, std::uint64_t times, Outcome& outcome) const {
    outcome.farthest = farthest_;
    std::vector<Piece>& left = outcome.left;
    left.push_back(whole);
    for (std::size_t kept = 0; left.size() > kept;) {
      Piece piece = left.back();
      const double limit = enough(outcome.farthest.distance);
      if (piece.bound > limit && outcome.pieces == times) {
        std::swap(left[kept++], left.back());
        continue;
      }
      left.pop_back();
      if (piece.bound > limit) {
        ++outcome.pieces;
        look_into(piece, limit, outcome);
      } else {
        outcome.settled = std::max(outcome.settled, piece.bound);
      }
    }
  }

  void look_into(Piece& piece, double limit, Outcome& outcome) const {
    const LevelView& to = to_[piece.side];
    if (!piece.is_segment) flatten(piece, (limit + slack_ - outcome.farthest.distance) / 4);
    const auto measured = [&](const Point& point, std::uint32_t hint) {
      return measure(piece.side, point, hint, outcome.farthest, outcome.looks);
    };
    const Point middle =
        scaled(1.0 / 3, plus(plus(piece.corner[0].point, piece.corner[1].point), piece.corner[2].point));
    const std::uint32_t known[] = {piece.corner[0].nearest, piece.corner[1].nearest, piece.corner[2].nearest};
    const std::uint32_t nearest = measured(middle, nearest_of(to, middle, known).triangle).nearest;
    tighten(to, {&nearest, 1}, limit, piece);
    if (piece.bound <= limit || piece.depth == kDeepest) {
      outcome.settled = std::max(outcome.settled, piece.bound);
      outcome.too_deep = outcome.too_deep || piece.bound > limit;
      return;
    }
    const Cut cut = choose_cut(piece, to.triangles[nearest], limit / 8);
    Corner points[2];
    for (int i = 0; i < cut.edges; ++i) {
      const Point point = point_of(piece, cut, i);
      const std::uint32_t near[] = {nearest, known[cut.edge[i]], known[(cut.edge[i] + 1) % 3]};
      const NearestTriangle guess = nearest_of(to, point, near);
      // Any triangle serves a bound; the nearest one is asked for only where the point may be the farthest.
      points[i] = {point, std::sqrt(guess.square), guess.triangle};
      if (points[i].distance > outcome.farthest.distance) points[i] = measured(point, guess.triangle);
    }
    Piece parts[kMostParts];
    const int count = cut_piece(piece, cut, points, parts);
    for (int i = 0; i < count; ++i) {
      parts[i].bound = piece.bound;
      tighten(to, {&nearest, 1}, limit, parts[i]);
      settle(parts[i], limit, outcome);
    }
  }

  HausdorffBound result() const {
    HausdorffBound bound;
    const LevelView& other = to_[farthest_.side];
    const double proved = proved_distance(other, farthest_.point, farthest_.nearest) - slack_;
    bound.lower = std::max(proved, 0.0);
    if (!is_refuted()) {
      double most = settled_;
      for (const Piece& piece : pool_) most = std::max(most, piece.bound);
      const double sure = (most + slack_) * (1 + 0x1p-50);
      bound.upper = sure * (1 + 0x1p-40);  // a little more, so that this very number can be wanted next
      bound.narrow = pool_.empty() && !too_deep_;
      if (options_.wanted) {
        bound.narrow = sure <= *options_.wanted;
        if (bound.narrow) bound.upper = std::min(bound.upper, *options_.wanted);
      }
    }
    for (int k = 0; k < 3; ++k) bound.point[k] = farthest_.point.x[k];
    bound.point_on_a = farthest_.side == 0;
    bound.pieces = pieces_;
    bound.looks = looks_;
    return bound;
  }

  LevelView from_[2], to_[2];
  HausdorffOptions options_;
  double largest_ = 0, slack_ = 0;
  CornerDistances corners_[2];
  Farthest farthest_;
  double settled_ = 0;
  std::vector<Piece> pool_;
  std::uint64_t pieces_ = 0, looks_ = 0;
  bool too_deep_ = false;
};

}  // namespace

HausdorffBound hausdorff_bound(const LevelView& a, const LevelView& b, const HausdorffOptions& options) {
  return Search(a, b, options).run();
}

}  // namespace tandem
