#include "contact_curves.h"

#include <Eigen/Geometry>
#include <algorithm>

namespace tandem::simulation {
namespace {

using Eigen::Vector3d;

// Points this part of the largest coordinate beside a plane count as in it: some hundred times what rounding
// of posed points and of their distance amounts to.
constexpr double kInPlane = 0x1p-44;

// A curve whose ends are apart by less than this part of its length closes.
constexpr double kClosed = 1e-6;

// Vertices inside the other body that are looked for, from the curve inwards: at most so many, and so many
// more for each triangle pair, so that work grows with the contacts however deep bodies overlap. Of what
// reaches further inside the depth is a lower bound.
constexpr std::size_t kMostEnclosed = 256, kMostEnclosedForEach = 6;

}  // namespace

void ContactCurves::add(const TriangleContact& contact, double tolerance, BodySide& a, BodySide& b) {
  const std::uint32_t slot_a = a.triangle(contact.triangle_a), slot_b = b.triangle(contact.triangle_b);
  const Meeting& meeting = meeting_;
  meet(a.at(slot_a), b.at(slot_b), tolerance, meeting_);
  if (meeting.kind == Meeting::Kind::none) return;
  const auto index = static_cast<std::uint32_t>(pieces_.size());
  CurvePiece& piece = pieces_.emplace_back();
  piece = {{contact.triangle_a, contact.triangle_b},
           {slot_a, slot_b},
           index,
           static_cast<std::uint32_t>(corners_.size()),
           meeting.corners,
           meeting.kind,
           meeting.facing,
           meeting.weight,
           {meeting.end[0], meeting.end[1]},
           {meeting.feature[0], meeting.feature[1]},
           Vector3d::Zero()};
  corners_.insert(corners_.end(), meeting.corner.begin(), meeting.corner.begin() + meeting.corners);
  if (meeting.facing) piece.area = meeting.area / 2 * a.at(slot_a).normal;
  degenerate_ = degenerate_ || meeting.degenerate;
  segments_ += meeting.kind == Meeting::Kind::segment;
  for (int i = 0; i < meeting.piercings; ++i) {
    const Piercing& p = meeting.piercing[i];
    const Surface& surface = (p.of_b ? b : a).shape().surface;
    const std::uint32_t t = p.of_b ? contact.triangle_b : contact.triangle_a;
    const bool upwards = surface.corner[t][p.edge] < surface.corner[t][(p.edge + 1) % 3];
    // Turned surfaces have their normals turned, so `inside` holds for them too.
    piercings_.push_back(
        {index, surface.edge_of[t][p.edge], p.of_b, p.first_inside == upwards, upwards ? p.at : 1 - p.at});
  }
}

// Ends are known by the edge and the triangle that meet there: every edge inside a surface has two triangles,
// so two pieces share the end. False where one is alone for another reason than an open surface's boundary:
// rounding chose another feature there, or a triangle pair is missing.
bool ContactCurves::connect_by_ends(const BodySide& a, const BodySide& b) {
  loose_.clear();
  table_.start(2 * pieces_.size());
  sets_.start(pieces_.size());
  const auto edge_of = [&](const CurvePiece& piece, int end) {
    const TriangleFeature& f = piece.feature[end];
    return (f.of_b ? b : a).shape().surface.edge_of[piece.triangle[f.of_b ? 1 : 0]][f.number];
  };
  const auto key_of = [&](const CurvePiece& piece, int end) {
    const bool of_b = piece.feature[end].of_b;
    return std::uint64_t{edge_of(piece, end)} << 33 | std::uint64_t{piece.triangle[of_b ? 0 : 1]} << 1 |
           (of_b ? 1u : 0u);
  };
  std::int64_t unmatched = 0;
  for (std::uint32_t i = 0; i < pieces_.size(); ++i) {
    for (int end = 0; end < 2; ++end) {
      bool is_new = false;
      const std::uint32_t first = table_.at(key_of(pieces_[i], end), i, is_new);
      const bool of_b = pieces_[i].feature[end].of_b;
      const std::uint32_t triangles = (of_b ? b : a).shape().surface.edge[edge_of(pieces_[i], end)].triangles;
      if (triangles > 2) return false;  // which of them belong together is open
      if (triangles == 1) loose_.push_back(i);
      if (triangles == 2) unmatched += is_new ? 1 : -1;
      if (!is_new) sets_.join(first, i);
    }
  }
  return unmatched == 0;
}

// Where corners lie in planes the ends are ambiguous: then pieces hang together whose triangles share a
// corner on both sides.
void ContactCurves::connect_by_corners(const BodySide& a, const BodySide& b) {
  loose_.clear();
  table_.start(9 * pieces_.size());
  sets_.start(pieces_.size());
  for (std::uint32_t i = 0; i < pieces_.size(); ++i) {
    for (const std::uint32_t u : a.shape().surface.corner[pieces_[i].triangle[0]]) {
      for (const std::uint32_t v : b.shape().surface.corner[pieces_[i].triangle[1]]) {
        bool is_new = false;
        sets_.join(table_.at(std::uint64_t{u} << 32 | v, i, is_new), i);
      }
    }
  }
}

// Curves are numbered by their first pieces.
void ContactCurves::number_curves() {
  curves_.clear();
  first_.clear();
  for (std::uint32_t i = 0; i < pieces_.size(); ++i) {
    const std::uint32_t root = sets_.find(i);
    if (root == i) {
      pieces_[i].curve = static_cast<std::uint32_t>(curves_.size());
      first_.push_back(i);
      curves_.push_back({Vector3d::Zero(), Vector3d::Zero(), Vector3d::Zero(), 0, true, degenerate_});
    } else {
      pieces_[i].curve = pieces_[root].curve;
    }
  }
}

void ContactCurves::measure(const BodySide& a, const BodySide& b) {
  const bool sheet_a = !a.shape().surface.closed, sheet_b = !b.shape().surface.closed;
  for (const CurvePiece& piece : pieces_) {
    Curve& curve = curves_[piece.curve];
    const Vector3d& origin = pieces_[first_[piece.curve]].end[0];
    curve.area += piece.area;
    const Vector3d along = piece.weight * (piece.end[1] - piece.end[0]);
    curve.area += 0.5 * (piece.end[0] - origin).cross(along);
    curve.residual += along;
    const double length = along.norm();
    curve.length += length;
    if (sheet_a || !sheet_b) curve.sheet_normal += length * a.at(piece.slot[0]).normal;
    if (sheet_b || !sheet_a) curve.sheet_normal -= length * b.at(piece.slot[1]).normal;
  }
  for (Curve& curve : curves_) curve.closed = curve.residual.norm() <= kClosed * curve.length;
  for (const std::uint32_t i : loose_) curves_[pieces_[i].curve].closed = false;
}

void ContactCurves::find_enclosed(BodySide& a, BodySide& b) {
  groups_.start(curves_.size());
  for (const PiecePiercing& p : piercings_) {
    (p.of_b ? b : a).add_piercing(p.edge, p.at, p.lower_inside, pieces_[p.piece].curve);
  }
  const auto may_spread = [&](std::uint32_t i) { return curves_[i].closed && !curves_[i].degenerate; };
  const auto joined = [&](std::uint32_t i, std::uint32_t j) { groups_.join(i, j); };
  const std::size_t most = kMostEnclosed + kMostEnclosedForEach * pieces_.size();
  a.find_enclosed(most, may_spread, joined);
  b.find_enclosed(most, may_spread, joined);
}

void ContactCurves::find(std::span<const TriangleContact> contacts, BodySide& a, BodySide& b) {
  pieces_.clear();
  piercings_.clear();
  corners_.clear();
  segments_ = 0;
  degenerate_ = false;
  const double tolerance = kInPlane * std::max(a.reach(), b.reach());
  for (const TriangleContact& contact : contacts) add(contact, tolerance, a, b);
  if (degenerate_ || !connect_by_ends(a, b)) {
    degenerate_ = true;
    connect_by_corners(a, b);
  }
  number_curves();
  measure(a, b);
  find_enclosed(a, b);
}

}  // namespace tandem::simulation
