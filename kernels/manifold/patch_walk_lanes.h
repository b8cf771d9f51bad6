#pragma once
#include "kernels/manifold/double_lanes.h"

#ifdef TANDEM_HAVE_LANES
#include <bit>
#include <cmath>

#include "kernels/manifold/manifold_lanes.h"

// The questions of surface_line.h, answered by one thread: all lines of a patch walk a tree at once, and four
// boxes or triangles are looked at at a time.
namespace tandem {
namespace {

/// Visits the blocks of a tree, depth first. A block is taken off the stack before its nodes are put there.
inline constexpr int kMostWaiting = 3 * static_cast<int>(kMaxDepth) + 1;

TANDEM_INLINE LaneMask<4> at_most(const Lanes4& x, const Lanes4& y) {
  return {x.v <= y.v};
}

/// The block is looked at soon.
TANDEM_INLINE void fetch(const Block& block) {
  __builtin_prefetch(&block);
  __builtin_prefetch(&block.half_extent[1]);
}

/// The triangles of the leaf block are looked at soon.
TANDEM_INLINE void fetch_leaves(const manifold::Body& body, const Block& block) {
  const char* const triangles = reinterpret_cast<const char*>(body.shape->triangles + block.index[0]);
  for (int line = 0; line < 3; ++line) __builtin_prefetch(triangles + 64 * line);
  __builtin_prefetch(triangles + 4 * sizeof(Triangle) - 1);
  __builtin_prefetch(body.shape->topology + block.index[0]);
}

struct BoxCoordinates {
  Lanes4 centre[3], half_extent[3];

  TANDEM_INLINE BoxCoordinates(const Block& block, const manifold::FloatVector& origin) {
    for (int k = 0; k < 3; ++k) {
      centre[k] = load(block.centre[k]) + -origin.x[k];
      half_extent[k] = load(block.half_extent[k]);
    }
  }
};

/// Nodes of a leaf block, where one is imaginary the first.
TANDEM_INLINE void leaves_of(const Block& block, std::uint32_t (&index)[kNodesPerBlock]) {
  for (int i = 0; i < kNodesPerBlock; ++i)
    index[i] = block.kind[i] == NodeKind::leaf ? block.index[i] : block.index[0];
}

class LineWalk {
 public:
  LineWalk(const manifold::Body& body, const manifold::PatchFrame& frame,
           manifold::LineQuestion* const* lines, int count)
      : body_(body), frame_(frame), lines_(lines), count_(count) {
    using namespace manifold;
    least_sine_ = lines[0]->least_sine;
    origin_ = point_in_mesh(body, frame.origin);
    direction_ = in_mesh(body, frame.n);
    u_ = in_mesh(body, frame.u), v_ = in_mesh(body, frame.v);
    for (int k = 0; k < 3; ++k) size_.x[k] = std::fabs(direction_.x[k]);
    double furthest = 0;
    for (int i = 0; i < count; ++i) {
      const LineQuestion& q = *lines[i];
      furthest = greater(furthest, std::fabs(q.at.x) + std::fabs(q.at.y) + std::fabs(q.target));
    }
    slack_ = slack_near(body, origin_) + static_cast<float>(furthest) * kBoxSlack;
    for (int i = 0; i < count; ++i) {
      const Vector2& at = lines[i]->at;
      FloatVector p;
      for (int k = 0; k < 3; ++k)
        p.x[k] = static_cast<float>(at.x) * u_.x[k] + static_cast<float>(at.y) * v_.x[k];
      const float(&d)[3] = direction_.x;
      line_[i].across[0] = p.x[2] * d[1] - p.x[1] * d[2];
      line_[i].across[1] = p.x[0] * d[2] - p.x[2] * d[0];
      line_[i].across[2] = p.x[1] * d[0] - p.x[0] * d[1];
    }
  }

  void answer() {
    unsigned asked = 0;
    for (int i = 0; i < count_; ++i) {
      look_within(i, lines_[i]->most);
      asked |= 1u << i;
    }
    walk(asked);
    asked = 0;
    for (int i = 0; i < count_; ++i) {
      const manifold::LineQuestion& q = *lines_[i];
      if (q.nearest <= q.most || q.most == INFINITY) continue;
      look_within(i, q.nearest);
      asked |= 1u << i;
    }
    if (asked != 0) walk(asked);
  }

 private:
  struct Line {
    float across[3];  // direction x point, from the origin on
    float from, to;   // heights that are looked at, from the origin on
  };
  struct Waiting {
    std::uint32_t block, lines;
  };

  TANDEM_INLINE void set_heights(int i, double most) {
    const manifold::LineQuestion& q = *lines_[i];
    line_[i].from = static_cast<float>(manifold::greater(q.lower, q.target - most)) - slack_;
    line_[i].to = static_cast<float>(manifold::lesser(q.upper, q.target + most)) + slack_;
  }
  TANDEM_INLINE void look_within(int i, double most) {
    manifold::LineQuestion& q = *lines_[i];
    q.most = most;
    q.nearest = INFINITY;
    q.best = {};
    set_heights(i, most);
  }

  TANDEM_INLINE void walk(unsigned asked) {
    Waiting waiting[kMostWaiting];
    int count = 0;
    waiting[count++] = {0, asked};
    const Block* fetched = nullptr;  // a leaf block that waits for its triangles
    unsigned lines_of_fetched = 0;
    while (count > 0) {
      const Waiting next = waiting[--count];
      const Block& block = body_.shape->blocks[next.block];
      unsigned below[kNodesPerBlock];
      const unsigned met = lines_that_meet(block, next.lines, below);
      if (met == 0) continue;
      if (block.is_leaf_block()) {
        fetch_leaves(body_, block);
        if (fetched != nullptr) visit(*fetched, lines_of_fetched);
        fetched = &block, lines_of_fetched = met;
        continue;
      }
      for (int i = kNodesPerBlock - 1; i >= 0; --i) {
        if (below[i] == 0) continue;
        fetch(body_.shape->blocks[block.index[i]]);
        waiting[count++] = {block.index[i], below[i]};
      }
    }
    if (fetched != nullptr) visit(*fetched, lines_of_fetched);
  }

  /// Tests four boxes and several lines, as LineTest::passes() does. What depends on the line alone or the
  /// box alone is computed once: each is projected across the direction.
  TANDEM_INLINE unsigned lines_that_meet(const Block& block, unsigned lines,
                                         unsigned (&below)[kNodesPerBlock]) const {
    const BoxCoordinates box(block, origin_);
    const Lanes4 &x = box.centre[0], &y = box.centre[1], &z = box.centre[2];
    const Lanes4(&h)[3] = box.half_extent;
    const float(&d)[3] = direction_.x, (&s)[3] = size_.x;
    const Lanes4 across[3] = {d[2] * y - d[1] * z, d[0] * z - d[2] * x, d[1] * x - d[0] * y};
    const Lanes4 extent[3] = {s[2] * h[1] + s[1] * h[2] + slack_, s[0] * h[2] + s[2] * h[0] + slack_,
                              s[1] * h[0] + s[0] * h[1] + slack_};
    const Lanes4 along = d[0] * x + d[1] * y + d[2] * z;
    const Lanes4 reach = s[0] * h[0] + s[1] * h[1] + s[2] * h[2] + slack_;
    const Lanes4 low = along - reach, high = along + reach;
    const typename Vector<4>::Bits is_real = h[0].v >= 0.0f;
    typename Vector<4>::Bits all = {};
    for (; lines != 0; lines &= lines - 1) {
      const int i = std::countr_zero(lines);
      const Line& line = line_[i];
      typename Vector<4>::Bits passes = is_real & ~(low.v > line.to) & ~(high.v < line.from);
      for (int k = 0; k < 3; ++k) passes &= ~(magnitude(across[k] + line.across[k]).v > extent[k].v);
      all |= passes & (1 << i);
    }
    __builtin_memcpy(below, &all, sizeof below);
    return below[0] | below[1] | below[2] | below[3];
  }

  /// LineQuestions::visit() and merge(), of four triangles.
  TANDEM_INLINE void visit(const Block& block, unsigned lines) {
    using D = DoubleLanes<4>;
    std::uint32_t index[kNodesPerBlock];
    leaves_of(block, index);
    Vector3Lanes<4> corner[3];
    for (int k = 0; k < 3; ++k) corner[k] = posed_corner(body_, index, k) - frame_.origin;
    const Vector3Lanes<4> normal = cross(corner[1] - corner[0], corner[2] - corner[0]);
    const D area = dot(frame_.n, normal), size = magnitude_of<4>(area), square = dot(normal, normal);
    const DoubleMask<4> turned = -__builtin_convertvector(turned_lanes(body_, index), DoubleMask<4>);
    const DoubleMask<4> upwards = turned ^ (area > 0);  // not turned: a positive area faces along the normal
    const DoubleMask<4> steep = area * area > (least_sine_ * least_sine_) * square;
    const D little = 1e-12 * size + 0x1p-48 * body_.reach * square_root(square_root(square));
    const D sign = area > 0 ? D{} + 1.0 : D{} - 1.0;
    D u[3], v[3], height_of[3];
    for (int k = 0; k < 3; ++k) {
      u[k] = dot(frame_.u, corner[k]), v[k] = dot(frame_.v, corner[k]);
      height_of[k] = dot(frame_.n, corner[k]);
    }
    const unsigned up = bits_of_mask(upwards & steep), down = bits_of_mask(~upwards & steep);
    for (; lines != 0; lines &= lines - 1) {
      const int i = std::countr_zero(lines);
      manifold::LineQuestion& q = *lines_[i];
      const unsigned facing = (q.facing >= 0 ? up : 0u) | (q.facing <= 0 ? down : 0u);
      if (facing == 0) continue;
      D x[3], y[3];
      for (int k = 0; k < 3; ++k) x[k] = u[k] - q.at.x, y[k] = v[k] - q.at.y;
      const D first = x[1] * y[2] - y[1] * x[2], second = x[2] * y[0] - y[2] * x[0],
              third = x[0] * y[1] - y[0] * x[1];
      const DoubleMask<4> within =
          (sign * first >= -little) & (sign * second >= -little) & (sign * third >= -little);
      unsigned found = bits_of_mask(within) & facing;
      if (found == 0) continue;
      const D height = (first * height_of[0] + second * height_of[1] + third * height_of[2]) / area;
      for (; found != 0; found &= found - 1) {
        const int n = std::countr_zero(found);
        manifold::Vector2 side[3];
        double of[3], at = height[n];
        for (int k = 0; k < 3; ++k) side[k] = {x[k][n], y[k][n]}, of[k] = height_of[k][n];
        if (manifold::LineQuestions::keep_on_triangle(side, of, 0x1p-46 * body_.reach, at))
          take(i, at, index[n]);
      }
    }
  }

  TANDEM_INLINE void take(int i, double height, std::uint32_t triangle) {
    manifold::LineQuestion& q = *lines_[i];
    if (!(height >= q.lower && height <= q.upper)) return;
    const double distance = std::fabs(height - q.target);
    if (distance > q.nearest || (distance == q.nearest && triangle >= q.best.triangle)) return;
    q.nearest = distance, q.best = {height, triangle};
    if (distance < q.most) set_heights(i, distance);
  }

  const manifold::Body& body_;
  const manifold::PatchFrame& frame_;
  manifold::LineQuestion* const* lines_;
  int count_;
  manifold::FloatVector origin_, direction_, size_, u_, v_;
  float slack_;
  double least_sine_;  // that of all lines of a frame
  Line line_[ManifoldLanes::kMostLines];
};

void answer_lines(const manifold::Body& body, const manifold::PatchFrame& frame,
                  manifold::LineQuestion* const* lines, int count) {
  LineWalk(body, frame, lines, count).answer();
}

}  // namespace
}  // namespace tandem
#endif
