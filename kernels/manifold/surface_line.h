#pragma once
#include <bit>
#include <cstdint>

#include "kernels/manifold/body.h"
#include "kernels/manifold/team.h"

/// Questions to the tree of a posed body: where a line meets its surface. Boxes are tested in float32 with
/// slack; triangles decide in float64. So the answers do not depend on which blocks are walked, nor in which
/// order. Imaginary boxes are told by their extent, and where a product is too large for float32, so that
/// comparisons fail, a box passes.
namespace tandem::manifold {

/// Float32 rounds coordinates, products and sums to 2^-24 of |box| + |point|; a dozen of them amount to less
/// than this part. The tolerance of triangles, 10^-12, is far below.
inline constexpr float kBoxSlack = 0x1p-18f;

/// The plane of a patch and the lines across it.
struct PatchFrame {
  Vector3 origin, u, v, n;

  PatchFrame() = default;
  TANDEM_HD PatchFrame(const Vector3& at, const Vector3& normal)
      : origin(at), u(unit_orthogonal(normal)), v(cross(normal, u)), n(normal) {}

  TANDEM_HD Vector2 flat(const Vector3& x) const {
    const Vector3 d = x - origin;
    return {dot(u, d), dot(v, d)};
  }
  TANDEM_HD double height(const Vector3& x) const { return dot(n, x - origin); }
  TANDEM_HD Vector3 at(const Vector2& x, double h) const { return origin + x.x * u + x.y * v + h * n; }
};

struct FloatVector {
  float x[3];
};

TANDEM_HD inline float dot(const FloatVector& p, const FloatVector& q) {
  return p.x[0] * q.x[0] + p.x[1] * q.x[1] + p.x[2] * q.x[2];
}

/// A direction of the world along the axes of the mesh.
TANDEM_HD inline FloatVector in_mesh(const Body& body, const Vector3& direction) {
  FloatVector out{};
  for (int k = 0; k < 3; ++k) {
    const auto& r = body.pose.rotation;
    out.x[k] = static_cast<float>(r[0][k] * direction.x + r[1][k] * direction.y + r[2][k] * direction.z);
  }
  return out;
}

/// A point of the world in stored coordinates.
TANDEM_HD inline FloatVector point_in_mesh(const Body& body, const Vector3& point) {
  const double* t = body.pose.translation;
  return in_mesh(body, point - Vector3{t[0], t[1], t[2]});
}

/// Returns how much float32 may be off for boxes of this body near a point of stored coordinates.
TANDEM_HD inline float slack_near(const Body& body, const FloatVector& point) {
  const Shape& shape = *body.shape;
  const double far = std::fabs(shape.centre.x) + std::fabs(shape.centre.y) + std::fabs(shape.centre.z) +
                     shape.diagonal + std::fabs(point.x[0]) + std::fabs(point.x[1]) + std::fabs(point.x[2]);
  return static_cast<float>(far) * kBoxSlack + static_cast<float>(body.reach) * 0x1p-42f;
}

/// Tests of boxes have slack, so a GPU computes them the quick way.
TANDEM_HD inline float fused(float x, float y, float z) {
#ifdef __CUDA_ARCH__
  return __fmaf_rn(x, y, z);
#else
  return x * y + z;
#endif
}
TANDEM_HD inline float quotient(float x, float y) {
#ifdef __CUDA_ARCH__
  return __fdividef(x, y);
#else
  return x / y;
#endif
}

/// A rotation from the axes of the mesh to those of a block's frame. Its rounding, some twenty units of the
/// vector's, is within kBoxSlack.
class ToBlock {
 public:
  TANDEM_HD explicit ToBlock(const BlockRotation& rotation)
      : w_(quaternion_part(rotation, 0)),
        v_{{quaternion_part(rotation, 1), quaternion_part(rotation, 2), quaternion_part(rotation, 3)}},
        two_by_square_(quotient(2, fused(w_, w_, dot(v_, v_)))) {}

  TANDEM_HD FloatVector operator()(const FloatVector& p) const {
    const FloatVector across = cross(v_, p), twice = cross(v_, across);
    FloatVector out;
    for (int k = 0; k < 3; ++k) out.x[k] = fused(two_by_square_, fused(-w_, across.x[k], twice.x[k]), p.x[k]);
    return out;
  }

 private:
  TANDEM_HD static FloatVector cross(const FloatVector& p, const FloatVector& q) {
    return {{fused(p.x[1], q.x[2], -(p.x[2] * q.x[1])), fused(p.x[2], q.x[0], -(p.x[0] * q.x[2])),
             fused(p.x[0], q.x[1], -(p.x[1] * q.x[0]))}};
  }

  float w_;
  FloatVector v_;
  float two_by_square_;
};

/// The nodes of a block whose boxes pass a test, a bit each. The block is read as a whole: float4 loads on a
/// GPU.
template <typename AnyBlock, typename Test>
TANDEM_HD inline unsigned nodes_that_pass(const AnyBlock& block, const Test& test) {
  unsigned mask = 0;
#ifdef __CUDA_ARCH__
#pragma unroll
#endif
  for (int i = 0; i < kNodesPerBlock; ++i) {
    const FloatVector centre = {{block.centre[0][i], block.centre[1][i], block.centre[2][i]}};
    const FloatVector half = {{block.half_extent[0][i], block.half_extent[1][i], block.half_extent[2][i]}};
    mask |= test.passes(centre, half) ? 1u << i : 0u;
  }
  return mask;
}

/// The blocks or triangles below those nodes of a block that pass a test.
struct Below {
  unsigned mask = 0;  ///< these nodes
  bool leaves = false;
  std::uint32_t index[kNodesPerBlock];  ///< of blocks, or of triangles where they are leaves
};

/// Imaginary boxes pass no test that compares with <=.
template <typename Test>
TANDEM_HD inline Below look_below(const Shape& shape, std::uint32_t index, const Test& test) {
  Below out;
  if (shape.blocks != nullptr) {
    const Block& block = shape.blocks[index];
    out.mask = nodes_that_pass(block, test);
    out.leaves = block.is_leaf_block();
    for (int i = 0; i < kNodesPerBlock; ++i) out.index[i] = block.index[i];
  } else {
    const OrientedBlock block = shape.oriented_blocks[index];
    out.mask = nodes_that_pass(block, test.turned(ToBlock(block.rotation)));
    out.leaves = (block.first_below & OrientedBlock::kIsLeafBlock) != 0;
    const std::uint32_t first = block.first_below & ~OrientedBlock::kIsLeafBlock;
    for (int i = 0; i < kNodesPerBlock; ++i) out.index[i] = first + static_cast<std::uint32_t>(i);
  }
  return out;
}

/// The place where a line along a patch's normal meets a surface.
struct Crossing {
  double height = 0;
  std::uint32_t triangle = kNoIndex;

  TANDEM_HD bool found() const { return triangle != kNoIndex; }
};

/// Triangles that the normal grazes at less than this sine are walls, which have no height.
inline constexpr double kWall = 0.01;

/// A line that is to miss no surface meets triangles down to this sine. Where it grazes one so, rounding
/// moves the place by up to some 10^-10 of the coordinates.
inline constexpr double kGrazes = 1e-6;

/// Boxes that the line meets, no further from the target along it than `reach`, and with heights above it
/// between `lower` and `upper`.
struct alignas(16) LineTest {
  FloatVector point, direction;  // at the target's height
  float lower, upper, slack, reach;

  TANDEM_HD LineTest turned(const ToBlock& to_block) const {
    return {to_block(point), to_block(direction), lower, upper, slack, reach};
  }
  TANDEM_HD bool passes(const FloatVector& c, const FloatVector& h) const {
    const float x = c.x[0] - point.x[0], y = c.x[1] - point.x[1], z = c.x[2] - point.x[2];
    const float p = direction.x[0], q = direction.x[1], r = direction.x[2];
    const float ap = std::fabs(p), aq = std::fabs(q), ar = std::fabs(r);
    const bool beside = (std::fabs(fused(y, r, -(z * q))) > fused(h.x[1], ar, fused(h.x[2], aq, slack))) |
                        (std::fabs(fused(z, p, -(x * r))) > fused(h.x[2], ap, fused(h.x[0], ar, slack))) |
                        (std::fabs(fused(x, q, -(y * p))) > fused(h.x[0], aq, fused(h.x[1], ap, slack)));
    const float along = fused(x, p, fused(y, q, z * r)),
                extent = fused(h.x[0], ap, fused(h.x[1], aq, fused(h.x[2], ar, slack)));
    const bool away =
        (std::fabs(along) - extent > reach) | (along + extent < lower) | (along - extent > upper);
    return (h.x[0] >= 0) & !(beside | away);
  }
};

/// Says which crossing of a line with a surface is asked for: the one nearest in height to `target`, between
/// lower and upper, of triangles whose outward normals point along the frame's (facing 1), against it (-1) or
/// either way (0). If two are as near, the triangle that comes first is taken.
struct LineQuestion {
  const PatchFrame* frame;  ///< the line runs along its normal; all of the team see it
  Vector2 at;
  double target, lower, upper;
  double most;        ///< it is looked for no further from the target
  double least_sine;  ///< triangles that the line grazes at less do not count
  double length;      ///< of a straight line from one point to another
  int side, facing;

  LineTest test;  ///< of boxes

  double nearest;
  Crossing best;
};

class LineQuestions {
 public:
  TANDEM_HD LineQuestions(const BodyPair& bodies, LineQuestion* questions)
      : bodies_(bodies), questions_(questions) {}

  /// expected: how far from the target it is, mostly; it is looked for there first.
  TANDEM_HD void ask(std::uint32_t question, const PatchFrame& frame, int side, int facing, const Vector2& at,
                     double target, double lower, double upper, double expected, double least_sine) const {
    LineQuestion& q = questions_[question];
    q.frame = &frame;
    q.least_sine = least_sine;
    q.at = at;
    q.target = target, q.lower = lower, q.upper = upper;
    q.side = side, q.facing = facing;
    q.most = expected;
  }

  /// Makes the test of boxes.
  TANDEM_HD void prepare(std::uint32_t question) const {
    LineQuestion& q = questions_[question];
    const Body& body = bodies_[q.side];
    LineTest& test = q.test;
    test.point = point_in_mesh(body, q.frame->at(q.at, q.target));
    test.direction = in_mesh(body, q.frame->n);
    test.slack = slack_near(body, test.point);
    test.lower = static_cast<float>(q.lower - q.target) - test.slack;
    test.upper = static_cast<float>(q.upper - q.target) + test.slack;
    look_within(q, q.most);
  }

  /// Answers the first `count` questions; those of no side were not asked. Lines of a frame are followed
  /// together.
  template <typename Lanes>
  void answer(const Lanes& lanes, std::uint32_t count) const {
    for (std::uint32_t first = 0, next = 0; first < count; first = next) {
      const PatchFrame* const frame = questions_[first].frame;
      for (next = first + 1; next < count && questions_[next].frame == frame;) ++next;
      for (int side = 0; side < 2; ++side) {
        LineQuestion* asked[Lanes::kMostLines];
        int lines = 0;
        for (std::uint32_t i = first; i < next; ++i) {
          if (questions_[i].side == side) asked[lines++] = &questions_[i];
        }
        if (lines > 0) lanes.answer_lines(bodies_[side], *frame, asked, lines);
      }
    }
  }

  /// If nothing lies as near as expected, the walk has to look further away. Not all boxes there were looked
  /// at, so what was found there need not be the nearest.
  TANDEM_HD void look_further(std::uint32_t question) const {
    look_within(questions_[question], questions_[question].nearest);
  }
  TANDEM_HD bool has_to_look_further(std::uint32_t question) const {
    const LineQuestion& q = questions_[question];
    return q.nearest > q.most && q.most != INFINITY;
  }

  TANDEM_HD const BodyPair& bodies() const { return bodies_; }
  TANDEM_HD LineQuestion* questions() const { return questions_; }
  /// Returns where the line meets a triangle, if that is no further from the target than what was found.
  TANDEM_HD Crossing visit(std::uint32_t question, std::uint32_t t) const {
    const LineQuestion& q = questions_[question];
    const Body& body = bodies_[q.side];
    const PatchFrame& frame = *q.frame;
    const Triangle stored = body.shape->triangles[t];
    Vector3 corner[3];
    for (int k = 0; k < 3; ++k) corner[k] = body.posed(stored.corner[k]) - frame.origin;
    const Vector3 normal = cross(corner[1] - corner[0], corner[2] - corner[0]);
    const double area = dot(frame.n, normal), size = std::fabs(area), square = dot(normal, normal);
    const bool turned = is_turned(body.shape->topology[t].flags);
    const int facing = (area > 0) != turned ? 1 : -1;
    if (q.facing * facing < 0 || !(area * area > (q.least_sine * q.least_sine) * square)) return {};
    Vector2 side[3];
    for (int k = 0; k < 3; ++k) side[k] = Vector2{dot(frame.u, corner[k]), dot(frame.v, corner[k])} - q.at;
    // Shares of the corners, times the area. What lies on an edge, or beside it by no more than rounding of
    // posed points and a little of the triangle, belongs to both triangles: no line slips through.
    const double first = cross(side[1], side[2]), second = cross(side[2], side[0]),
                 third = cross(side[0], side[1]);
    const double little = 1e-12 * size + 0x1p-48 * body.reach * std::sqrt(std::sqrt(square));
    const double sign = area > 0 ? 1 : -1;
    if (!(sign * first >= -little && sign * second >= -little && sign * third >= -little)) return {};
    const double of[3] = {dot(frame.n, corner[0]), dot(frame.n, corner[1]), dot(frame.n, corner[2])};
    double height = (first * of[0] + second * of[1] + third * of[2]) / area;
    if (!keep_on_triangle(side, of, 0x1p-46 * body.reach, height)) return {};
    const bool is_asked = height >= q.lower && height <= q.upper && is_nearer(q, {height, t});
    return is_asked ? Crossing{height, t} : Crossing{};
  }
  /// Takes a crossing if it is nearer than what was found; of two as near, the triangle that comes first.
  TANDEM_HD void take(std::uint32_t question, const Crossing& crossing) const {
    LineQuestion& q = questions_[question];
    if (!is_nearer(q, crossing)) return;
    q.nearest = std::fabs(crossing.height - q.target), q.best = crossing;
    q.test.reach = lesser(q.test.reach, static_cast<float>(q.nearest) + q.test.slack);
  }

  /// Far from the origin, where rounding is much of a triangle that the line grazes, its shares are known
  /// badly: the line meets it only where its box is, give or take `rounding`, so that every walk looks there.
  /// corner: from the line on, across it; of: heights of the corners.
  TANDEM_HD static bool keep_on_triangle(const Vector2 (&corner)[3], const double (&of)[3], double rounding,
                                         double& height) {
    const auto least = [](double p, double q, double r) { return lesser(lesser(p, q), r); };
    const auto greatest = [](double p, double q, double r) { return greater(greater(p, q), r); };
    height = lesser(greater(height, least(of[0], of[1], of[2])), greatest(of[0], of[1], of[2]));
    return least(corner[0].x, corner[1].x, corner[2].x) <= rounding &&
           greatest(corner[0].x, corner[1].x, corner[2].x) >= -rounding &&
           least(corner[0].y, corner[1].y, corner[2].y) <= rounding &&
           greatest(corner[0].y, corner[1].y, corner[2].y) >= -rounding;
  }

 private:
  TANDEM_HD static bool is_nearer(const LineQuestion& q, const Crossing& crossing) {
    const double distance = std::fabs(crossing.height - q.target);
    return distance < q.nearest || (distance == q.nearest && crossing.triangle < q.best.triangle);
  }
  TANDEM_HD static void look_within(LineQuestion& q, double most) {
    q.most = most;
    q.test.reach = static_cast<float>(most) + q.test.slack;
    q.nearest = INFINITY;
    q.best = {};
  }

  const BodyPair& bodies_;
  LineQuestion* questions_;
};

/// Looks for what a question asks for in the tree of its body, by one thread.
TANDEM_HD inline void walk_line(const LineQuestions& questions, std::uint32_t question) {
  const LineQuestion& asked = questions.questions()[question];
  std::uint32_t waiting[3 * kMaxDepth + 1] = {0};
  for (int count = 1; count > 0;) {
    const Below below = look_below(*questions.bodies()[asked.side].shape, waiting[--count], asked.test);
    for (int i = 0; i < kNodesPerBlock; ++i) {
      if ((below.mask >> i & 1u) == 0) continue;
      if (!below.leaves) {
        waiting[count++] = below.index[i];
        continue;
      }
      const Crossing crossing = questions.visit(question, below.index[i]);
      if (crossing.found()) questions.take(question, crossing);
    }
  }
}

/// Answers a question, if it is asked, by one thread.
TANDEM_HD inline void answer_line(const LineQuestions& questions, std::uint32_t question) {
  if (questions.questions()[question].side < 0) return;
  questions.prepare(question);
  walk_line(questions, question);
  if (!questions.has_to_look_further(question)) return;
  questions.look_further(question);
  walk_line(questions, question);
}

/// Answers the first `count` questions about lines; those of no side are not asked. All of the team see them.
template <typename Team>
TANDEM_HD void walk_lines(const Team& team, const LineQuestions& questions, std::uint32_t count) {
  if constexpr (HasLanes<Team>) {
    questions.answer(team.lanes(), count);
  } else if constexpr (HasWarps<Team>) {
    team.walk_lines(questions, count);
  } else {
    for (std::uint32_t i = 0; i < count; ++i) answer_line(questions, i);
  }
}

}  // namespace tandem::manifold
