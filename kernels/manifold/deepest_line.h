#pragma once
#include "kernels/manifold/overlap_lines.h"

/// The search for the line along a patch's normal on which two bodies overlap most.
///
/// On a line along the normal n, let an interval of a end at height h_a, and an interval of b begin at height
/// h_b below that. While b moves along n, the two overlap at last when it has moved by h_a - h_b, the depth
/// of the line. A line counts if the intervals overlap as the bodies lie. It counts too if they will, and if
/// from then back to now the overlap goes on: that is shown by a point of the overlap from which one straight
/// line within a leads to a's interval, and another within b leads to b's, since each line along n between
/// them meets both. Convex bodies have nothing else. The depth of the deepest line that counts is how far b
/// is to be moved to end the overlap.
///
/// The depth is a linear function of the place of the line where one triangle of a and one of b lie above
/// each other, so the deepest line goes through a corner of the polygon that the two have in common, as seen
/// along n. Both trees are walked together, and no pair of boxes is looked at that cannot be deeper than what
/// is known. That begins with lines through a few points of the overlap. Nor is a pair looked at that is
/// deeper everywhere than kDeeperBy times that, as where other parts of the bodies lie above each other: only
/// if a line comes near this limit, the search goes on from there. (Of convex bodies the depth is a concave
/// function of the line's place, so there are lines of all depths up to the deepest one's.)
///
/// The result is the deepest line that counts, and of equally deep ones that of the least triangles. So it
/// does not depend on the order of the search, nor on how many search together.
namespace tandem::manifold {

/// Lines are looked for that are deeper than what is known by these factors; if one is deeper by a factor of
/// kDeeperBy / kNotMuchDeeper, then from there on.
inline constexpr double kDeeperBy = 1.25, kNotMuchDeeper = 1.1;

/// Lines go through so many points of a region at most; through half as many if it has few pieces.
inline constexpr int kMostSeeds = 8;
inline constexpr std::uint32_t kFewPieces = 64;

/// A region of more pieces than kManyPieces that is deeper than kDeep of its reach is not searched: its depth
/// is that of the lines through those points. Fine meshes that are so far within each other have too many
/// other parts above each other.
inline constexpr std::uint32_t kManyPieces = 256;
inline constexpr double kDeep = 0.25;

/// Triangles that the normal grazes at less than this sine have no height.
inline constexpr double kGrazes = 1e-5;

/// The axes of a patch's frame in the stored coordinates of a body, and where that body's origin lies.
struct FramedBody {
  Vector3 axis[3];
  double offset[3];
  double slack;  ///< more than what rounding does to the coordinates of boxes and corners

  TANDEM_HD void set(const Body& body, const PatchFrame& frame, double tolerance) {
    const Vector3 along[3] = {frame.u, frame.v, frame.n};
    const auto& r = body.pose.rotation;
    const double* const t = body.pose.translation;
    const Vector3 from = Vector3{t[0], t[1], t[2]} - frame.origin;
    for (int k = 0; k < 3; ++k) {
      const Vector3& e = along[k];
      axis[k] = {r[0][0] * e.x + r[1][0] * e.y + r[2][0] * e.z, r[0][1] * e.x + r[1][1] * e.y + r[2][1] * e.z,
                 r[0][2] * e.x + r[1][2] * e.y + r[2][2] * e.z};
      offset[k] = dot(e, from);
    }
    slack = tolerance;
  }
  TANDEM_HD Vector3 placed(const Triangle::Corner& corner) const {
    const Vector3 x = {corner.position[0], corner.position[1], corner.position[2]};
    return {dot(axis[0], x) + offset[0], dot(axis[1], x) + offset[1], dot(axis[2], x) + offset[2]};
  }
};

/// The part of space that is searched: a box along the axes of the patch's frame.
struct SearchWindow {
  double lower[3], upper[3];

  TANDEM_HD SearchWindow() = default;
  TANDEM_HD SearchWindow(const double (&middle)[3], double reach) {
    for (int k = 0; k < 3; ++k) lower[k] = middle[k] - reach, upper[k] = middle[k] + reach;
  }
};

/// The boxes of a block's nodes in the patch's frame.
struct FramedNodes {
  double lower[3][kNodesPerBlock], upper[3][kNodesPerBlock];
  std::uint32_t index[kNodesPerBlock];
  bool real[kNodesPerBlock];
  bool leaves;

  TANDEM_HD FramedNodes(const Shape& shape, const FramedBody& body, std::uint32_t at) {
    if (shape.blocks != nullptr) {
      const Block& block = shape.blocks[at];
      leaves = block.is_leaf_block();
      for (int i = 0; i < kNodesPerBlock; ++i) index[i] = block.index[i];
      place(block, body.axis, body, body.slack);
    } else {
      const OrientedBlock& block = shape.oriented_blocks[at];
      leaves = block.is_leaf_block();
      const std::uint32_t first = block.first_below & ~OrientedBlock::kIsLeafBlock;
      for (int i = 0; i < kNodesPerBlock; ++i) index[i] = first + static_cast<std::uint32_t>(i);
      const BlockAxes axes(block.rotation);
      Vector3 turned[3];
      for (int k = 0; k < 3; ++k) {
        double along[3];
        for (int m = 0; m < 3; ++m) {
          const float(&e)[3] = axes.axis[m].x;
          along[m] = dot(body.axis[k], Vector3{e[0], e[1], e[2]});
        }
        turned[k] = {along[0], along[1], along[2]};
      }
      // The axes of the block are of float32.
      const double far =
          std::fabs(shape.centre.x) + std::fabs(shape.centre.y) + std::fabs(shape.centre.z) + shape.diagonal;
      place(block, turned, body, body.slack + far * static_cast<double>(kBoxSlack));
    }
  }

 private:
  template <typename AnyBlock>
  TANDEM_HD void place(const AnyBlock& block, const Vector3 (&axis)[3], const FramedBody& body,
                       double slack) {
    for (int i = 0; i < kNodesPerBlock; ++i) real[i] = block.half_extent[0][i] >= 0;
    for (int k = 0; k < 3; ++k) {
      const Vector3& e = axis[k];
      const Vector3 size = {std::fabs(e.x), std::fabs(e.y), std::fabs(e.z)};
      for (int i = 0; i < kNodesPerBlock; ++i) {  // in lanes
        const double at = e.x * double{block.centre[0][i]} + e.y * double{block.centre[1][i]} +
                          e.z * double{block.centre[2][i]} + body.offset[k],
                     extent = size.x * double{block.half_extent[0][i]} +
                              size.y * double{block.half_extent[1][i]} +
                              size.z * double{block.half_extent[2][i]} + slack;
        lower[k][i] = at - extent, upper[k][i] = at + extent;
      }
    }
  }
};

/// A triangle in the patch's frame that faces along the normal, of a, or against it, of b. Nothing is set
/// until set() is called.
struct FramedTriangle {
  double x[3], y[3], z[3];  ///< of the corners, counter-clockwise as seen against the normal
  double lower[3], upper[3];
  double slope_x, slope_y;  ///< height = z[0] + slope_x * (x - x[0]) + slope_y * (y - y[0])
  bool faces;

  TANDEM_HD void set(const Body& of, const FramedBody& body, std::uint32_t index, int side) {
    const Triangle stored = of.shape->triangles[index];
    const bool turned = is_turned(of.shape->topology[index].flags);
    const Vector3 p = body.placed(stored.corner[0]), q = body.placed(stored.corner[1]),
                  r = body.placed(stored.corner[2]);
    const Vector3 n = cross(q - p, r - p);
    faces = std::fabs(n.z) > kGrazes * norm(n) && (n.z > 0) == ((side == 0) != turned);
    if (!faces) return;
    slope_x = -n.x / n.z, slope_y = -n.y / n.z;
    const bool clockwise = n.z < 0;
    x[0] = p.x, y[0] = p.y, z[0] = p.z;
    x[1] = clockwise ? r.x : q.x, y[1] = clockwise ? r.y : q.y, z[1] = clockwise ? r.z : q.z;
    x[2] = clockwise ? q.x : r.x, y[2] = clockwise ? q.y : r.y, z[2] = clockwise ? q.z : r.z;
    for (int k = 0; k < 3; ++k) {
      const double(&v)[3] = k == 0 ? x : k == 1 ? y : z;
      lower[k] = lesser(v[0], lesser(v[1], v[2])), upper[k] = greater(v[0], greater(v[1], v[2]));
    }
  }
  TANDEM_HD double height(double at_x, double at_y) const {
    return z[0] + (slope_x * (at_x - x[0]) + slope_y * (at_y - y[0]));
  }
  /// Returns how far a point lies inside the side from corner k on, times that side's length.
  TANDEM_HD double inside(int k, double at_x, double at_y) const {
    const int next = k == 2 ? 0 : k + 1;
    return (x[next] - x[k]) * (at_y - y[k]) - (y[next] - y[k]) * (at_x - x[k]);
  }
};

/// A line on which a triangle of a lies above one of b.
struct OverlapLine {
  double depth = 0;
  std::uint32_t triangle[2] = {kNoIndex, kNoIndex};
  Vector2 at;        ///< where it is deepest
  double height[2];  ///< of a, of b
  Vector2 within;    ///< a little inside the polygon that both triangles have in common
  double height_within[2];

  TANDEM_HD std::uint64_t key() const { return std::uint64_t{triangle[0]} << 32 | triangle[1]; }
  TANDEM_HD bool found() const { return triangle[0] != kNoIndex; }
  /// Deeper ones come first, and of equally deep ones those of lesser triangles.
  TANDEM_HD bool comes_before(double other_depth, std::uint64_t other_key) const {
    return depth > other_depth || (depth == other_depth && key() < other_key);
  }
};

/// A line that is looked at moves this part of the way from the deepest corner of a polygon to its middle, so
/// that it does not run along an edge.
inline constexpr double kOffCorner = 0.01;

/// The polygon that two triangles have in common within a window, as seen along the normal.
class CommonPolygon {
 public:
  TANDEM_HD CommonPolygon(const FramedTriangle& a, const FramedTriangle& b, const SearchWindow& window,
                          double most)
      : a_(a), b_(b) {
    for (int k = 0; k < 3; ++k) x_[k] = a.x[k], y_[k] = a.y[k];
    count_ = 3;
    for (int k = 0; k < 3 && count_ > 0; ++k) cut([&](double x, double y) { return b.inside(k, x, y); });
    const auto reaches_below = [&](int k) { return greater(a.lower[k], b.lower[k]) < window.lower[k]; };
    const auto reaches_above = [&](int k) { return lesser(a.upper[k], b.upper[k]) > window.upper[k]; };
    if (reaches_below(0)) cut([&](double x, double) { return x - window.lower[0]; });
    if (reaches_above(0)) cut([&](double x, double) { return window.upper[0] - x; });
    if (reaches_below(1)) cut([&](double, double y) { return y - window.lower[1]; });
    if (reaches_above(1)) cut([&](double, double y) { return window.upper[1] - y; });
    if (a.upper[2] > window.upper[2])
      cut([&](double x, double y) { return window.upper[2] - a.height(x, y); });
    if (b.lower[2] < window.lower[2])
      cut([&](double x, double y) { return b.height(x, y) - window.lower[2]; });
    if (a.upper[2] - b.lower[2] > most)
      cut([&](double x, double y) { return most - (a.height(x, y) - b.height(x, y)); });
  }

  /// Finds the line through the corner where a is highest above b; false if there is no polygon.
  TANDEM_HD bool deepest(OverlapLine& out) const {
    if (count_ == 0) return false;
    Vector2 middle;
    int best = 0;
    double depth = -INFINITY;
    for (int i = 0; i < count_; ++i) {
      middle = middle + Vector2{x_[i], y_[i]};
      const double here = a_.height(x_[i], y_[i]) - b_.height(x_[i], y_[i]);
      if (here > depth) depth = here, best = i;
    }
    out.depth = depth;
    out.at = {x_[best], y_[best]};
    out.within = out.at + kOffCorner * ((1.0 / count_) * middle - out.at);
    out.height[0] = a_.height(out.at.x, out.at.y), out.height[1] = b_.height(out.at.x, out.at.y);
    out.height_within[0] = a_.height(out.within.x, out.within.y);
    out.height_within[1] = b_.height(out.within.x, out.within.y);
    return true;
  }

 private:
  /// Keeps where a linear function is not negative.
  template <typename Value>
  TANDEM_HD void cut(const Value& value) {
    double at[kMost];
    bool any = false;
    for (int i = 0; i < count_; ++i) {
      at[i] = value(x_[i], y_[i]);
      any = any || at[i] < 0;
    }
    if (!any) return;
    double x[kMost], y[kMost];
    int count = 0;
    for (int i = 0; i < count_; ++i) {
      const int next = i + 1 == count_ ? 0 : i + 1;
      if (at[i] >= 0 && count < kMost) x[count] = x_[i], y[count] = y_[i], ++count;
      if (((at[i] > 0 && at[next] < 0) || (at[i] < 0 && at[next] > 0)) && count < kMost) {
        const double part = at[i] / (at[i] - at[next]);
        x[count] = x_[i] + part * (x_[next] - x_[i]), y[count] = y_[i] + part * (y_[next] - y_[i]), ++count;
      }
    }
    for (int i = 0; i < count; ++i) x_[i] = x[i], y_[i] = y[i];
    count_ = count;
  }

  static constexpr int kMost = 13;  // each of ten cuts of a convex polygon adds one corner

  const FramedTriangle &a_, &b_;
  double x_[kMost], y_[kMost];
  int count_;
};

/// A block pair of which some pairs of nodes are still to be followed. Bit 4 i + j of `children` is the pair
/// of the i-th highest node of a and the j-th lowest of b; above the 16 bits there are two for each node's
/// place in that order.
struct WaitingPair {
  std::uint32_t block[2];  ///< kNoIndex: the one pair below is that of the roots
  std::uint32_t children;

  TANDEM_HD int node(int side, int place) const {
    return static_cast<int>(children >> (16 + 8 * side + 2 * place) & 3u);
  }
};

/// A point of a piece: of a polygon a corner, else the point that is nearest to x.
TANDEM_HD inline Vector3 nearest_point(const Piece& piece, const Vector3& x) {
  if (piece.kind() == MeetingKind::polygon) return piece.end[0];
  const Vector3 d = x - piece.end[0], e = piece.end[1] - piece.end[0];
  const double along = dot(d, e), length = dot(e, e);
  const double part = along > 0 ? (along < length ? along / length : 1.0) : 0.0;
  return piece.end[0] + part * e;
}

/// The memory that a team shares while it looks for the deepest line.
struct SearchMemory {
  static constexpr std::uint32_t kMostWaiting = 2 * kMaxDepth;

  Vector3 seed[kMostSeeds];  ///< points of the overlap
  int seeds;
  FramedBody body[2];
  SearchWindow window;
  double most;  ///< no line is looked for that is deeper
  OverlapLine best, candidate;
  WaitingPair waiting[kMostWaiting];
  std::uint32_t count;
  LineQuestion line[2 * kMostSeeds];
};

/// Looks for the deepest line of the overlap that the pieces order[begin] to order[end - 1] bound.
template <typename Team>
class DeepestLine {
 public:
  TANDEM_HD DeepestLine(const Team& team, const BodyPair& bodies, const PieceMemory& memory,
                        const PieceSummary& summary, std::uint32_t region, SearchMemory& shared)
      : team_(team),
        bodies_(bodies),
        memory_(memory),
        pieces_(summary.pieces),
        one_region_(summary.curves <= 1),
        begin_(memory.start[region]),
        end_(memory.start[region + 1]),
        wide_(one_region_),
        many_(end_ - begin_ > kManyPieces),
        shared_(shared) {}

  /// Finds points of the overlap beside some pieces; find() needs them. middle, reach: as there.
  TANDEM_HD void find_seeds(const Vector3& middle);

  /// Returns whether one body ends within the other on the deepest line.
  TANDEM_HD bool goes_through(const PatchFrame& frame);

  /// Finds the deepest of the lines through the seeds.
  TANDEM_HD void begin_with_seeds(const PatchFrame& frame);

  /// Finds shared.best; none where the bodies do not overlap along the normal. middle, reach: a ball around
  /// the pieces. The search begins there. If there is one region, or several curves bound this one, it goes
  /// further while the deepest line lies near its border. It ends as soon as a line is as deep as `enough`.
  TANDEM_HD void find(const PatchFrame& frame, const Vector3& middle, double reach, double enough);

 private:
  static constexpr std::uint32_t kAllPairs = 0xFFFFu;

  TANDEM_HD void search(const PatchFrame& frame, double enough);
  TANDEM_HD bool take(std::uint32_t (&block)[2]);
  TANDEM_HD std::uint32_t pairs_that_may_be_deeper(const FramedNodes& a, const FramedNodes& b) const;
  TANDEM_HD void push(const std::uint32_t (&block)[2], const FramedNodes& a, const FramedNodes& b,
                      std::uint32_t pairs);
  TANDEM_HD OverlapLine deepest_of(const FramedNodes& a, const FramedNodes& b, std::uint32_t pairs,
                                   const OverlapLine& below) const;
  TANDEM_HD void look_behind(const PatchFrame& frame, const OverlapLine& line, double& begin_a,
                             double& end_b);
  TANDEM_HD bool takes_candidate(const PatchFrame& frame);
  TANDEM_HD_SELDOM bool will_overlap(const PatchFrame& frame);
  TANDEM_HD bool may_be_deeper(const double (&lower_a)[3], const double (&upper_a)[3],
                               const double (&lower_b)[3], const double (&upper_b)[3]) const {
    const SearchWindow& w = shared_.window;
    bool meet = true;
    for (int k = 0; k < 2; ++k) {
      meet = meet && greater(greater(lower_a[k], lower_b[k]), w.lower[k]) <=
                         lesser(lesser(upper_a[k], upper_b[k]), w.upper[k]);
    }
    const double depth = lesser(upper_a[2], w.upper[2]) - greater(lower_b[2], w.lower[2]);
    // Heights in a triangle are rounded, and may be above all of its corners.
    const double rounding = shared_.body[0].slack;
    return meet && depth > 0 && depth + rounding >= shared_.best.depth &&
           lower_a[2] - upper_b[2] <= shared_.most + rounding;
  }

  const Team& team_;
  const BodyPair& bodies_;
  const PieceMemory& memory_;
  std::uint32_t pieces_;
  bool one_region_;
  std::uint32_t begin_, end_;
  bool wide_;  ///< lines beyond the region count
  bool many_;
  SearchMemory& shared_;
};

/// Takes a pair of blocks off the waiting ones, each of the team another one; those of the newest entry come
/// first. As many are taken at a time as there is room for what they leave: each pushes one entry at most.
/// Where there is no more room than for the depth of a tree, one pair is taken at a time: entries above the
/// one that it comes from are then pairs of blocks below each other, at most kMaxDepth.
template <typename Team>
TANDEM_HD bool DeepestLine<Team>::take(std::uint32_t (&block)[2]) {
  const std::uint32_t count = shared_.count, spare = SearchMemory::kMostWaiting - kMaxDepth;
  const std::uint32_t most = count < spare ? spare - count : 1;
  const std::uint32_t wanted = Team::size() < most ? Team::size() : most;
  // Finds the entry, and its bit, that are this one's.
  std::uint32_t before = 0, left = count;
  bool mine = false;
  const auto bits = [](std::uint32_t x) {
    std::uint32_t n = 0;
    for (x &= kAllPairs; x != 0; x &= x - 1) ++n;
    return n;
  };
  while (left > 0 && before < wanted) {
    const WaitingPair& entry = shared_.waiting[left - 1];
    const std::uint32_t here = bits(entry.children);
    if (!mine && team_.rank() < wanted && team_.rank() >= before && team_.rank() < before + here) {
      mine = true;
      std::uint32_t rest = entry.children & kAllPairs;
      for (std::uint32_t i = before; i < team_.rank(); ++i) rest &= rest - 1;
      int bit = 0;
      while ((rest >> bit & 1u) == 0) ++bit;
      const int node[2] = {entry.node(0, bit / 4), entry.node(1, bit % 4)};
      for (int side = 0; side < 2; ++side) {
        if (entry.block[side] == kNoIndex) {
          block[side] = 0;
          continue;
        }
        const Shape& shape = *bodies_[side].shape;
        if (shape.blocks != nullptr) {
          const Block& of = shape.blocks[entry.block[side]];
          block[side] = of.is_leaf_block() ? entry.block[side] : of.index[node[side]];
        } else {
          const OrientedBlock& of = shape.oriented_blocks[entry.block[side]];
          block[side] = of.is_leaf_block() ? entry.block[side]
                                           : of.first_below + static_cast<std::uint32_t>(node[side]);
        }
      }
    }
    before += here, --left;
  }
  team_.sync();  // all have seen what waits
  if (team_.rank() == 0) {
    // The last entry that was looked at may have pairs left.
    const std::uint32_t over = before > wanted ? before - wanted : 0;
    if (over > 0) {
      std::uint32_t& children = shared_.waiting[left].children;
      const std::uint32_t taken = bits(children) - over;
      std::uint32_t rest = children & kAllPairs;
      for (std::uint32_t i = 0; i < taken; ++i) rest &= rest - 1;
      children = (children & ~kAllPairs) | rest;
      ++left;
    }
    shared_.count = left;
  }
  team_.sync();
  return mine;
}

/// The pairs of nodes, as node of a times 4 plus node of b, that may have a line deeper than the best.
template <typename Team>
TANDEM_HD std::uint32_t DeepestLine<Team>::pairs_that_may_be_deeper(const FramedNodes& a,
                                                                    const FramedNodes& b) const {
  const SearchWindow& w = shared_.window;
  const double least = greater(shared_.best.depth, 0.0), most = shared_.most;
  double lower_b[3][kNodesPerBlock], upper_b[3][kNodesPerBlock];  // within the window
  for (int k = 0; k < 3; ++k) {
    for (int j = 0; j < kNodesPerBlock; ++j) {
      lower_b[k][j] = greater(b.lower[k][j], w.lower[k]);
      upper_b[k][j] = k == 2 ? b.upper[k][j] : lesser(b.upper[k][j], w.upper[k]);
    }
  }
  std::uint32_t pairs = 0;
  for (int i = 0; i < kNodesPerBlock; ++i) {
    if (!a.real[i]) continue;
    const double highest = lesser(a.upper[2][i], w.upper[2]);
    bool may[kNodesPerBlock];
    for (int j = 0; j < kNodesPerBlock; ++j) {  // in lanes
      may[j] = (greater(a.lower[0][i], lower_b[0][j]) <= lesser(a.upper[0][i], upper_b[0][j])) &
               (greater(a.lower[1][i], lower_b[1][j]) <= lesser(a.upper[1][i], upper_b[1][j])) &
               (highest - lower_b[2][j] >= least) & (a.lower[2][i] - upper_b[2][j] <= most);
    }
    for (int j = 0; j < kNodesPerBlock; ++j) pairs |= may[j] && b.real[j] ? 1u << (4 * i + j) : 0u;
  }
  return pairs;
}

/// Adds an entry: pairs of nodes, those that promise most first. A leaf block stays whole, as long as the
/// other body's is none.
template <typename Team>
TANDEM_HD void DeepestLine<Team>::push(const std::uint32_t (&block)[2], const FramedNodes& a,
                                       const FramedNodes& b, std::uint32_t pairs) {
  int order[2][kNodesPerBlock];
  for (int side = 0; side < 2; ++side) {
    const auto before = [&](int i, int j) {
      return side == 0 ? a.upper[2][i] > a.upper[2][j] : b.lower[2][i] < b.lower[2][j];
    };
    for (int i = 0; i < kNodesPerBlock; ++i) {
      int k = i;
      for (; k > 0 && before(i, order[side][k - 1]); --k) order[side][k] = order[side][k - 1];
      order[side][k] = i;
    }
  }
  WaitingPair entry = {{block[0], block[1]}, 0};
  for (int i = 0; i < kNodesPerBlock; ++i) {
    for (int side = 0; side < 2; ++side)
      entry.children |= static_cast<std::uint32_t>(order[side][i]) << (16 + 8 * side + 2 * i);
    for (int j = 0; j < kNodesPerBlock; ++j) {
      if ((pairs >> (4 * order[0][i] + order[1][j]) & 1u) == 0) continue;
      entry.children |= 1u << (4 * (a.leaves ? 0 : i) + (b.leaves ? 0 : j));
    }
  }
  shared_.waiting[team_.add(shared_.count, 1)] = entry;
}

/// The deepest line of the leaves' triangles that comes after `below`, if that is one, and before the best.
template <typename Team>
TANDEM_HD OverlapLine DeepestLine<Team>::deepest_of(const FramedNodes& a, const FramedNodes& b,
                                                    std::uint32_t pairs, const OverlapLine& below) const {
  OverlapLine found;
  FramedTriangle of_b[kNodesPerBlock];
  for (int j = 0; j < kNodesPerBlock; ++j) {
    if ((pairs >> j & 0x1111u) != 0) of_b[j].set(bodies_.b, shared_.body[1], b.index[j], 1);
  }
  for (int i = 0; i < kNodesPerBlock; ++i) {
    if ((pairs >> (4 * i) & 15u) == 0) continue;
    FramedTriangle of_a;
    of_a.set(bodies_.a, shared_.body[0], a.index[i], 0);
    if (!of_a.faces) continue;
    for (int j = 0; j < kNodesPerBlock; ++j) {
      const FramedTriangle& other = of_b[j];
      if ((pairs >> (4 * i + j) & 1u) == 0 || !other.faces) continue;
      if (!may_be_deeper(of_a.lower, of_a.upper, other.lower, other.upper)) continue;
      OverlapLine line;
      if (!CommonPolygon(of_a, other, shared_.window, shared_.most).deepest(line)) continue;
      line.triangle[0] = a.index[i], line.triangle[1] = b.index[j];
      if (!(line.depth > 0) || !line.comes_before(shared_.best.depth, shared_.best.key())) continue;
      if (below.found() && !below.comes_before(line.depth, line.key())) continue;
      if (line.comes_before(found.depth, found.key())) found = line;
    }
  }
  return found;
}

/// Returns whether straight lines lead from the seed nearest to the candidate's line to its intervals of both
/// bodies.
template <typename Team>
TANDEM_HD_SELDOM bool DeepestLine<Team>::will_overlap(const PatchFrame& frame) {
  const OverlapLine& line = shared_.candidate;
  const Vector3 of_a = frame.at(line.within, line.height_within[0]),
                of_b = frame.at(line.within, line.height_within[1]), middle = 0.5 * (of_a + of_b);
  double least = INFINITY;
  Vector3 inside;
  for (int i = 0; i < shared_.seeds; ++i) {
    const Vector3 apart = shared_.seed[i] - middle;
    if (dot(apart, apart) < least) least = dot(apart, apart), inside = shared_.seed[i];
  }
  const OverlapLines<Team> lines(team_, bodies_, memory_, shared_.line);
  return shared_.seeds > 0 && lines.is_free(of_a, inside, 0, 0) && lines.is_free(of_b, inside, 1, 1);
}

/// Finds where a begins below its end on a line, and where b ends above its beginning; or infinite heights.
template <typename Team>
TANDEM_HD void DeepestLine<Team>::look_behind(const PatchFrame& frame, const OverlapLine& line,
                                              double& begin_a, double& end_b) {
  const double tolerance = bodies_.tolerance();
  LineQuestions questions(bodies_, frame, shared_.line);
  for (std::uint32_t side = team_.rank(); side < 2; side += team_.size()) {
    const double from = line.height_within[side];
    questions.ask(side, static_cast<int>(side), side == 0 ? -1 : 1, line.within, from,
                  side == 0 ? -INFINITY : from + tolerance, side == 0 ? from - tolerance : INFINITY,
                  INFINITY);
  }
  team_.sync();
  walk_lines(team_, questions, 2, shared_.line);
  const Crossing &of_a = shared_.line[0].best, &of_b = shared_.line[1].best;
  begin_a = of_a.found() ? of_a.height : -INFINITY;
  end_b = of_b.found() ? of_b.height : INFINITY;
  team_.sync();  // all have read the answers
}

template <typename Team>
TANDEM_HD bool DeepestLine<Team>::goes_through(const PatchFrame& frame) {
  const OverlapLine& line = shared_.best;
  if (!line.found()) return false;
  double begin_a = 0, end_b = 0;
  look_behind(frame, line, begin_a, end_b);
  return begin_a > line.height_within[1] || end_b < line.height_within[0];
}

/// Makes the candidate's line the best if it counts, and no other region's pieces are nearer to where a and b
/// overlap there, or will.
template <typename Team>
TANDEM_HD bool DeepestLine<Team>::takes_candidate(const PatchFrame& frame) {
  const OverlapLine& line = shared_.candidate;
  double begin_a = 0, end_b = 0;
  look_behind(frame, line, begin_a, end_b);
  const bool overlaps = begin_a < end_b - bodies_.tolerance();
  bool takes = overlaps || (wide_ && will_overlap(frame));
  if (takes && !one_region_) {
    const double middle =
        0.5 * greater(begin_a, line.height_within[1]) + 0.5 * lesser(end_b, line.height_within[0]);
    const Vector3 x = frame.at(line.within, middle);
    double nearest[2] = {INFINITY, INFINITY};  // of others, of its own
    for (std::uint32_t i = team_.rank(); i < pieces_; i += team_.size()) {
      const Vector3 apart = x - nearest_point(memory_.pieces[memory_.order[i]], x);
      double& least = nearest[i >= begin_ && i < end_ ? 1 : 0];
      least = lesser(dot(apart, apart), least);
    }
    team_.least_ones(nearest);
    takes = nearest[1] <= nearest[0];
  }
  team_.sync();
  if (takes && team_.rank() == 0) shared_.best = line;
  team_.sync();
  return takes;
}

template <typename Team>
TANDEM_HD void DeepestLine<Team>::search(const PatchFrame& frame, double enough) {
  if (team_.rank() == 0) {
    shared_.count = 1;
    shared_.waiting[0] = {{kNoIndex, kNoIndex}, 1};
  }
  team_.sync();
  while (team_.load(shared_.count) > 0 && shared_.best.depth < enough) {
    std::uint32_t block[2], pairs = 0;
    const bool mine = take(block);
    bool leaves = false;
    if (mine) {
      const FramedNodes a(*bodies_.a.shape, shared_.body[0], block[0]),
          b(*bodies_.b.shape, shared_.body[1], block[1]);
      pairs = pairs_that_may_be_deeper(a, b);
      leaves = a.leaves && b.leaves && pairs != 0;
      if (!leaves && pairs != 0) push(block, a, b, pairs);
    }
    OverlapLine below;
    while (team_.any(leaves)) {
      OverlapLine found;
      if (leaves) {
        const FramedNodes a(*bodies_.a.shape, shared_.body[0], block[0]),
            b(*bodies_.b.shape, shared_.body[1], block[1]);
        found = deepest_of(a, b, pairs, below);
        leaves = found.found();
      }
      const double greatest = team_.greatest(found.found() ? found.depth : -INFINITY);
      if (greatest == -INFINITY) break;
      const bool may = found.found() && found.depth == greatest;
      const std::uint64_t key = team_.least(may ? found.key() : ~std::uint64_t{0});
      if (may && found.key() == key) shared_.candidate = found;
      team_.sync();
      below = shared_.candidate;
      if (takes_candidate(frame)) break;
    }
    team_.sync();
  }
}

template <typename Team>
TANDEM_HD void DeepestLine<Team>::find_seeds(const Vector3& middle) {
  const OverlapLines<Team> lines(team_, bodies_, memory_, shared_.line);
  const double most = greater(bodies_.a.shape->diagonal, bodies_.b.shape->diagonal);
  const int wanted = end_ - begin_ <= kFewPieces ? kMostSeeds / 2 : kMostSeeds;
  Vector3 beside[kMostSeeds] = {middle};
  int count = 0;
  for (int i = 0; i < wanted; ++i) {
    const std::uint32_t piece = lines.extreme_piece(begin_, end_, beside, i == 0 ? 1 : i, i == 0 ? 1 : -1);
    beside[i] = memory_.pieces[piece].middle();
    Vector3 inside;
    if (!lines.go_inside(piece, most, inside)) continue;
    if (team_.rank() == 0) shared_.seed[count] = inside;
    ++count;
  }
  if (team_.rank() == 0) shared_.seeds = count;
  team_.sync();
}

template <typename Team>
TANDEM_HD void DeepestLine<Team>::begin_with_seeds(const PatchFrame& frame) {
  LineQuestions questions(bodies_, frame, shared_.line);
  const auto count = 2 * static_cast<std::uint32_t>(shared_.seeds);
  for (std::uint32_t i = team_.rank(); i < count; i += team_.size()) {
    const Vector3& seed = shared_.seed[i / 2];
    const int side = static_cast<int>(i % 2);
    const double from = frame.height(seed);
    questions.ask(i, side, side == 0 ? 1 : -1, frame.flat(seed), from, side == 0 ? from : -INFINITY,
                  side == 0 ? INFINITY : from, INFINITY);
  }
  team_.sync();
  if (count > 0) walk_lines(team_, questions, count, shared_.line);
  if (team_.rank() == 0) {
    shared_.best = {};
    for (std::uint32_t i = 0; i < count; i += 2) {
      const Crossing &top = shared_.line[i].best, &bottom = shared_.line[i + 1].best;
      if (!top.found() || !bottom.found()) continue;
      OverlapLine line;
      line.at = line.within = shared_.line[i].at;
      line.height[0] = line.height_within[0] = top.height;
      line.height[1] = line.height_within[1] = bottom.height;
      line.depth = top.height - bottom.height;
      line.triangle[0] = top.triangle, line.triangle[1] = bottom.triangle;
      if (line.depth > 0 && line.comes_before(shared_.best.depth, shared_.best.key())) shared_.best = line;
    }
    shared_.most = shared_.best.found() ? kDeeperBy * shared_.best.depth : INFINITY;
  }
  team_.sync();
}

template <typename Team>
TANDEM_HD void DeepestLine<Team>::find(const PatchFrame& frame, const Vector3& middle, double reach,
                                       double enough) {
  const double tolerance = bodies_.tolerance();
  double far = 0;
  for (int side = 0; side < 2; ++side) {
    const Body& body = bodies_[side];
    far = greater(far, norm(body.centre - middle) + body.shape->diagonal);
  }
  const Vector2 flat = frame.flat(middle);
  const double at[3] = {flat.x, flat.y, frame.height(middle)};
  team_.sync();
  if (team_.rank() == 0) {
    for (int side = 0; side < 2; ++side) shared_.body[side].set(bodies_[side], frame, tolerance);
  }
  begin_with_seeds(frame);
  const OverlapLine& best = shared_.best;
  double half = greater(wide_ ? 2 * reach : reach, 16 * tolerance);
  if (best.depth >= enough || (many_ && best.depth > kDeep * reach)) return;
  while (best.depth < enough) {
    team_.sync();
    if (team_.rank() == 0) shared_.window = SearchWindow(at, half);
    team_.sync();
    search(frame, enough);
    const bool inner = best.found() && std::fabs(best.at.x - at[0]) <= half / 2 &&
                       std::fabs(best.at.y - at[1]) <= half / 2 && best.height[0] <= at[2] + half / 2 &&
                       best.height[1] >= at[2] - half / 2;
    const bool further = wide_ && !inner && half<far, deeper = best.depth> shared_.most / kNotMuchDeeper;
    if (!further && !deeper) return;
    if (further) half *= 2;
    team_.sync();  // all have read the limit
    if (deeper && team_.rank() == 0) shared_.most = kDeeperBy * best.depth;
  }
}

}  // namespace tandem::manifold
