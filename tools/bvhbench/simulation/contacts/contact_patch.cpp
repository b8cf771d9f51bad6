#include "contact_patch.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

namespace tandem::simulation {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

// An area vector below this part of length times largest coordinate is rounding: the surfaces only touch.
constexpr double kNoArea = 0x1p-40;

// Faces in so few directions on either side make a patch one of flat faces; otherwise it is a smooth one.
constexpr std::size_t kMostDirections = 5;

// Directions closer than this are the same: sine of half a milliradian, and its cosine.
constexpr double kSameDirection = 1 - 1e-7;

// How far a line that sounds the depth at the rim is moved inwards, as a part of the way to the middle, so
// that it does not run along a wall that made the rim.
constexpr double kInwards = 0.02;

// Triangles that the normal grazes at less than this sine are walls, which have no height.
constexpr double kWall = 0.01;

// How far beside a line a triangle may lie that stands in where the line hits none, as a part of the patch's
// extent.
constexpr double kBeside = 0.1;

// Points of a patch closer than this part of the smaller body's diagonal are one.
constexpr double kNear = 0.005;

// An inner point is kept where it lies deeper than the rim by this factor.
constexpr double kDeeper = 1.25;

std::uint64_t mixed(std::uint64_t x) {  // SplitMix64's finish
  x = (x ^ (x >> 30)) * 0xBF58476D1CE4E5B9u;
  x = (x ^ (x >> 27)) * 0x94D049BB133111EBu;
  return x ^ (x >> 31);
}

std::uint64_t feature_hash(std::uint64_t x, std::uint64_t y) {
  return std::max<std::uint64_t>(1, mixed(mixed(x + 0x9E3779B97F4A7C15u) ^ y));
}

// Moves `x` to the nearest point of a counter-clockwise triangle, and says how far.
double nearest_point(const Vector2d* corner, Vector2d& x) {
  const Vector2d from = x;
  double least = INFINITY;
  bool outside = false;
  for (int k = 0; k < 3; ++k) {
    const Vector2d side = corner[(k + 1) % 3] - corner[k], to = from - corner[k];
    if (side.x() * to.y() - side.y() * to.x() >= 0) continue;
    outside = true;
    const Vector2d at = corner[k] + std::clamp(side.dot(to) / side.squaredNorm(), 0.0, 1.0) * side;
    const double distance = (at - from).norm();
    if (distance < least) least = distance, x = at;
  }
  return outside ? least : 0;
}

}  // namespace

// Of several curves around one region, those whose area vectors oppose each other go through a body: then
// only those count that push the bodies to the sides on which their middles are.
void ContactPatches::keep_curves(std::uint32_t group) {
  current_ = group;
  const auto curves = curves_->curves();
  Vector3d sum = Vector3d::Zero();
  double sizes = 0;
  std::size_t members = 0;
  for (std::size_t i = 0; i < curves.size(); ++i) {
    kept_[i] = in_group(static_cast<std::uint32_t>(i));
    if (kept_[i] == 0) continue;
    sum += curves[i].area;
    sizes += curves[i].area.norm();
    ++members;
  }
  if (members < 2 || sum.norm() >= sizes / 2) return;
  const Vector3d apart = b_->center() - a_->center();
  const auto agrees = [&](std::size_t i) { return kept_[i] != 0 && curves[i].area.dot(apart) > 0; };
  bool any = false;
  for (std::size_t i = 0; i < curves.size(); ++i) any = any || agrees(i);
  for (std::size_t i = 0; any && i < curves.size(); ++i) kept_[i] = agrees(i);
}

void ContactPatches::gather_candidates() {
  candidates_.clear();
  const auto pieces = curves_->pieces();
  for (const CurvePiece& piece : pieces) {
    if (!in_patch(piece.curve)) continue;
    const std::uint64_t both = std::uint64_t{piece.triangle[0]} << 32 | piece.triangle[1];
    if (piece.kind == Meeting::Kind::polygon) {
      std::uint64_t corner = 8;
      if (piece.facing) {
        for (const Vector3d& x : curves_->corners(piece)) {
          candidates_.push_back({x, feature_hash(both, corner++)});
        }
      }
      continue;
    }
    // Closed curves have each end twice.
    const Curve& curve = curves_->curves()[piece.curve];
    const int ends = curve.closed && !curve.degenerate ? 1 : 2;
    for (int end = 0; end < ends; ++end) {
      const TriangleFeature& f = piece.feature[end];
      const Surface& own = (f.of_b ? b_ : a_)->shape().surface;
      const std::uint32_t t = piece.triangle[f.of_b ? 1 : 0];
      const std::uint64_t number = f.is_corner ? own.corner[t][f.number] : own.edge_of[t][f.number];
      const std::uint64_t key = number << 32 | piece.triangle[f.of_b ? 0 : 1];
      candidates_.push_back(
          {piece.end[end], feature_hash(key, (f.of_b ? 2u : 0u) + (f.is_corner ? 1u : 0u))});
    }
  }
}

// The corners of a's triangles in the patch, and of b's, with all that is enclosed.
void ContactPatches::gather_supports() {
  for (auto& supports : supports_) supports.clear();
  std::uint32_t last[2] = {kNoIndex, kNoIndex};
  for (const CurvePiece& piece : curves_->pieces()) {
    if (!in_patch(piece.curve)) continue;
    for (int side = 0; side < 2; ++side) {
      if (last[side] == piece.slot[side]) continue;
      last[side] = piece.slot[side];
      const auto& corner = (side == 0 ? a_ : b_)->at(piece.slot[side]).corner;
      supports_[side].insert(supports_[side].end(), corner, corner + 3);
    }
  }
  for (int side = 0; side < 2; ++side) {
    for (const BodySide::Enclosed& v : (side == 0 ? a_ : b_)->enclosed()) {
      if (in_group(v.curve)) supports_[side].push_back(v.position);
    }
  }
}

// How far b must move along n until a plane across n lies between all of the triangles there. The overlap
// alone would not do: the tip of a pyramid in the ground is narrower than it is deep, yet the ground goes on.
double ContactPatches::width(const Vector3d& n) const {
  double highest_a = -INFINITY, lowest_b = INFINITY;
  for (const Vector3d& x : supports_[0]) highest_a = std::max(highest_a, n.dot(x - candidates_[0].x));
  for (const Vector3d& x : supports_[1]) lowest_b = std::min(lowest_b, n.dot(x - candidates_[0].x));
  return highest_a - lowest_b;
}

// Where few flat faces meet, as boxes do, the curve's own normal leans a little, by depth over length: along
// the face normal that separates the bodies soonest they stay upright.
Vector3d ContactPatches::face_nearest(const Vector3d& smooth) {
  directions_.clear();
  std::size_t own[2] = {0, 0};
  for (const CurvePiece& piece : curves_->pieces()) {
    if (!in_patch(piece.curve)) continue;
    for (int side = 0; side < 2; ++side) {
      const Vector3d n = side == 0 ? a_->at(piece.slot[0]).normal : Vector3d(-b_->at(piece.slot[1]).normal);
      const bool known = std::any_of(directions_.begin(), directions_.end(),
                                     [&](const Vector3d& d) { return d.dot(n) > kSameDirection; });
      if (known) continue;
      if (++own[side] > kMostDirections) return smooth;
      directions_.push_back(n);
    }
  }
  const Vector3d apart = b_->center() - a_->center();
  Vector3d best = smooth;
  double least = width(smooth) * (1 + 1e-9);
  for (const Vector3d& n : directions_) {
    const double cosine = n.dot(smooth);
    if (cosine < 0.1 && (cosine < -0.1 || n.dot(apart) <= 0)) continue;
    const double of_n = width(n);
    if (of_n < least) best = n, least = of_n * (1 - 1e-9);
  }
  return best;
}

// Bodies that touch without a patch: the one direction, of those of their faces there and of crossings of
// their edges, that has all of a's triangles there on one side and b's on the other.
bool ContactPatches::normal_of_touch() {
  directions_.clear();
  const double tolerance = 0x1p-40 * std::max(a_->reach(), b_->reach());
  const auto separates = [&](const Vector3d& n, const Vector3d& x) {
    for (const CurvePiece& piece : curves_->pieces()) {
      if (!in_patch(piece.curve)) continue;
      for (int k = 0; k < 3; ++k) {
        if (n.dot(a_->at(piece.slot[0]).corner[k] - x) > tolerance) return false;
        if (n.dot(b_->at(piece.slot[1]).corner[k] - x) < -tolerance) return false;
      }
    }
    return true;
  };
  const auto consider = [&](const Vector3d& n, const Vector3d& x) {
    const bool known = std::any_of(directions_.begin(), directions_.end(),
                                   [&](const Vector3d& d) { return d.dot(n) > kSameDirection; });
    if (!known && separates(n, x)) directions_.push_back(n);
  };
  for (const CurvePiece& piece : curves_->pieces()) {
    if (!in_patch(piece.curve) || directions_.size() > 1) continue;
    const WorldTriangle &a = a_->at(piece.slot[0]), &b = b_->at(piece.slot[1]);
    consider(a.normal, piece.end[0]);
    consider(-b.normal, piece.end[0]);
  }
  for (const CurvePiece& piece : curves_->pieces()) {
    if (!in_patch(piece.curve) || !directions_.empty()) continue;
    const WorldTriangle &a = a_->at(piece.slot[0]), &b = b_->at(piece.slot[1]);
    for (int i = 0; i < 9; ++i) {
      const Vector3d e = a.corner[(i / 3 + 1) % 3] - a.corner[i / 3],
                     f = b.corner[(i % 3 + 1) % 3] - b.corner[i % 3];
      const Vector3d n = e.cross(f);
      if (n.norm() <= 1e-6 * e.norm() * f.norm()) continue;
      consider(n.normalized(), piece.end[0]);
      consider(-n.normalized(), piece.end[0]);
    }
  }
  if (directions_.size() != 1)
    return false;  // corner on corner, or edges along each other: nothing to lean on
  normal_ = directions_[0];
  return true;
}

bool ContactPatches::choose_normal() {
  const auto curves = curves_->curves();
  Vector3d area = Vector3d::Zero(), sheet = Vector3d::Zero();
  double length = 0;
  bool closes = true;
  for (std::size_t i = 0; i < curves.size(); ++i) {
    if (kept_[i] == 0) continue;
    area += curves[i].area;
    sheet += curves[i].sheet_normal;
    length += curves[i].length;
    closes = closes && curves[i].closed;
  }
  area_ = area;
  const double reach = std::max(a_->reach(), b_->reach());
  touch_ = closes ? area.norm() <= kNoArea * reach * length : sheet.norm() <= kNoArea * length;
  if (candidates_.empty()) return false;
  if (touch_ || !(length > 0) || !std::isfinite(length)) {
    const double polygons = area.norm();
    if (!touch_ || !(polygons > kNoArea * reach * reach)) {
      touch_ = true;
      return normal_of_touch();
    }
    touch_ = false;
  }
  gather_supports();
  normal_ = face_nearest((closes ? area : sheet).normalized());
  return true;
}

void ContactPatches::make_frame(const Vector3d& n) {
  frame_.origin = candidates_[0].x;
  frame_.n = n;
  frame_.u = n.unitOrthogonal();
  frame_.v = n.cross(frame_.u);
  width_ = touch_ ? 0 : width(n);
}

void ContactPatches::add_sounding(const Vector2d& at, const Vector2d& sounded_at, double height,
                                  std::uint64_t feature, bool inner) {
  soundings_.push_back({at, sounded_at, height, feature, inner, height, height, nearest_, nearest_});
}

// The corners of the hull of all candidates.
void ContactPatches::gather_rim(std::size_t most) {
  flat_.clear();
  for (std::uint32_t i = 0; i < candidates_.size(); ++i) flat_.push_back({frame_.flat(candidates_[i].x), i});
  convex_hull(flat_, hull_);
  simplify_hull(hull_, most, 1e-4);
  Vector2d middle = Vector2d::Zero();
  for (const PlanePoint& p : hull_) middle += p.x / static_cast<double>(hull_.size());
  double spread = 0;
  for (const PlanePoint& p : hull_) spread = std::max(spread, (p.x - middle).norm());
  const bool degenerate = std::any_of(curves_->curves().begin(), curves_->curves().end(),
                                      [](const Curve& curve) { return curve.degenerate; });
  nearest_ = (degenerate ? 2 : kBeside) * spread;
  soundings_.clear();
  for (const PlanePoint& p : hull_) {
    const Candidate& candidate = candidates_[p.index];
    add_sounding(p.x, p.x + kInwards * (middle - p.x), frame_.height(candidate.x), candidate.feature, false);
  }
}

// b's lowest enclosed vertex, a's highest, and the middle of the rim: at one of them the overlap is largest,
// or nearly.
void ContactPatches::gather_inner() {
  Vector2d middle = Vector2d::Zero();
  double height = 0;
  const auto rim = static_cast<double>(soundings_.size());
  for (const Sounding& s : soundings_) middle += s.at / rim, height += s.height / rim;
  for (const BodySide* side : {a_, b_}) {
    const double upwards = side == a_ ? 1 : -1;
    const BodySide::Enclosed* extreme = nullptr;
    double reach = 0;
    for (const BodySide::Enclosed& v : side->enclosed()) {
      if (!in_group(v.curve)) continue;
      const double of_v = upwards * frame_.height(v.position);
      if (extreme == nullptr || of_v > reach) extreme = &v, reach = of_v;
    }
    if (extreme == nullptr) continue;
    const Vector2d x = frame_.flat(extreme->position);
    add_sounding(x, x, upwards * reach, feature_hash(extreme->vertex, side == a_ ? 5 : 6), true);
  }
  add_sounding(middle, middle, height, feature_hash(current_, 4), true);
}

// Of a the highest triangle that faces along the normal counts, of b the lowest that faces against it; where
// a line hits none, the plane of the nearest one beside it. Little is amiss then but where corners of one
// body lie in faces of the other: rounding may keep triangles of a whole side out of the contacts.
void ContactPatches::sound_cut_triangles() {
  std::uint32_t last[2] = {kNoIndex, kNoIndex};
  for (const CurvePiece& piece : curves_->pieces()) {
    if (!in_group(piece.curve)) continue;
    for (int side = 0; side < 2; ++side) {
      if (last[side] == piece.slot[side]) continue;
      last[side] = piece.slot[side];
      const WorldTriangle& triangle = (side == 0 ? a_ : b_)->at(piece.slot[side]);
      const double cosine = triangle.normal.dot(frame_.n);
      if (side == 0 ? cosine < kWall : cosine > -kWall) continue;
      sound_cut_triangle(triangle, cosine, side == 1);
    }
  }
}

void ContactPatches::sound_cut_triangle(const WorldTriangle& triangle, double cosine, bool of_b) {
  Vector2d corner[3];
  for (int k = 0; k < 3; ++k) corner[k] = frame_.flat(triangle.corner[k]);
  if (twice_area(corner[0], corner[1], corner[2]) < 0) std::swap(corner[1], corner[2]);
  const Vector2d slope = -Vector2d(frame_.u.dot(triangle.normal), frame_.v.dot(triangle.normal)) / cosine;
  const double level = triangle.normal.dot(triangle.corner[0] - frame_.origin) / cosine;
  const Vector2d reach = Vector2d::Constant(nearest_);
  const Vector2d lower = corner[0].cwiseMin(corner[1]).cwiseMin(corner[2]) - reach,
                 upper = corner[0].cwiseMax(corner[1]).cwiseMax(corner[2]) + reach;
  for (Sounding& s : soundings_) {
    const Vector2d& x = s.sounded_at;
    if (x.x() < lower.x() || x.x() > upper.x() || x.y() < lower.y() || x.y() > upper.y()) continue;
    Vector2d at = x;
    const double beside = nearest_point(corner, at);
    double &nearest = of_b ? s.beside_bottom : s.beside_top, &known = of_b ? s.bottom : s.top;
    if (beside > nearest) continue;
    const double height = level + slope.dot(at);
    if (beside < nearest || (of_b ? height < known : height > known)) known = height;
    nearest = beside;
  }
}

void ContactPatches::sound_enclosed(const BodySide& side) {
  const bool of_b = &side == b_;
  const auto vertices = side.enclosed();
  flat_vertices_.resize(vertices.size());
  for (std::size_t i = 0; i < vertices.size(); ++i) {
    if (!in_group(vertices[i].curve)) continue;
    flat_vertices_[i] = {frame_.flat(vertices[i].position), frame_.height(vertices[i].position)};
  }
  for (const BodySide::EnclosedTriangle& t : side.enclosed_triangles()) {
    if (!in_group(t.curve)) continue;
    const FlatVertex &p = flat_vertices_[t.corner[0]], &q = flat_vertices_[t.corner[1]],
                     &r = flat_vertices_[t.corner[2]];
    const double area = twice_area(p.x, q.x, r.x);
    if (area == 0 || (area > 0) == (of_b != t.turned)) continue;  // faces the other way
    const Vector2d lower = p.x.cwiseMin(q.x).cwiseMin(r.x), upper = p.x.cwiseMax(q.x).cwiseMax(r.x);
    for (Sounding& s : soundings_) {
      const Vector2d& x = s.sounded_at;
      if (x.x() < lower.x() || x.x() > upper.x() || x.y() < lower.y() || x.y() > upper.y()) continue;
      const double of_p = twice_area(q.x, r.x, x) / area, of_q = twice_area(r.x, p.x, x) / area,
                   of_r = 1 - of_p - of_q;
      if (of_p < -1e-12 || of_q < -1e-12 || of_r < -1e-12) continue;
      const double height = of_p * p.height + of_q * q.height + of_r * r.height;
      double &nearest = of_b ? s.beside_bottom : s.beside_top, &known = of_b ? s.bottom : s.top;
      if (nearest > 0 || (of_b ? height < known : height > known)) known = height;
      nearest = 0;
    }
  }
}

void ContactPatches::sound() {
  sound_cut_triangles();
  sound_enclosed(*a_);
  sound_enclosed(*b_);
}

// Deeper points come first, then those further out; of points near each other the first stays.
void ContactPatches::merge_near(double distance) {
  Vector2d middle = Vector2d::Zero();
  for (const Chosen& c : chosen_) middle += c.x / static_cast<double>(chosen_.size());
  std::stable_sort(chosen_.begin(), chosen_.end(), [&](const Chosen& x, const Chosen& y) {
    if (x.depth != y.depth) return x.depth > y.depth;
    return (x.x - middle).squaredNorm() > (y.x - middle).squaredNorm();
  });
  std::size_t kept = 0;
  for (const Chosen& c : chosen_) {
    const bool near = std::any_of(chosen_.begin(), chosen_.begin() + static_cast<std::ptrdiff_t>(kept),
                                  [&](const Chosen& k) { return (k.x - c.x).norm() < distance; });
    if (!near) chosen_[kept++] = c;
  }
  chosen_.resize(kept);
}

// What a point is called: of all candidates so near that no other point can have them the one of the least
// number, so that it does not matter which of several at one corner was chosen.
void ContactPatches::name_points(double distance) {
  for (Chosen& c : chosen_) {
    if (c.inner) continue;
    for (const PlanePoint& p : flat_) {
      if ((p.x - c.x).norm() < distance) c.feature = std::min(c.feature, candidates_[p.index].feature);
    }
  }
}

void ContactPatches::choose_points() {
  const std::size_t most = options_.points_per_patch;
  gather_rim(std::max<std::size_t>(most, 2) - (touch_ ? 0 : 1));
  if (!touch_) {
    gather_inner();
    sound();
  }
  chosen_.clear();
  const Sounding* deepest = nullptr;
  double of_rim = 0;
  const auto depth_of = [&](const Sounding& s) { return std::clamp(s.top - s.bottom, 0.0, width_); };
  const auto choose = [&](const Sounding& s) {
    const double depth = depth_of(s);
    chosen_.push_back({s.at, depth > 0 ? (s.top + s.bottom) / 2 : s.height, depth, s.feature, s.inner});
  };
  for (const Sounding& s : soundings_) {
    if (s.inner) {
      if (deepest == nullptr || depth_of(s) > depth_of(*deepest)) deepest = &s;
      continue;
    }
    choose(s);
    of_rim = std::max(of_rim, chosen_.back().depth);
  }
  if (deepest != nullptr && depth_of(*deepest) > kDeeper * of_rim) choose(*deepest);
  const double near = kNear * std::min(a_->shape().diagonal, b_->shape().diagonal);
  merge_near(near);
  if (chosen_.size() > most) chosen_.resize(most);
  name_points(near / 2);
}

void ContactPatches::add(ContactCurves& curves, const BodySide& a, const BodySide& b,
                         const ObjectPair& bodies, const ContactOptions& options,
                         std::vector<ContactPoint>& points, ContactStatistics& statistics) {
  curves_ = &curves;
  a_ = &a, b_ = &b;
  options_ = options;
  const auto count = static_cast<std::uint32_t>(curves.curves().size());
  group_.resize(count);
  kept_.assign(count, 0);
  for (std::uint32_t i = 0; i < count; ++i) group_[i] = curves.group_of(i);
  statistics.segments += curves.segments();
  for (std::uint32_t i = 0; i < count; ++i) {
    if (group_[i] != i) continue;
    keep_curves(i);
    gather_candidates();
    if (!choose_normal()) {
      ++statistics.ambiguous_touches;
      continue;
    }
    make_frame(normal_);
    choose_points();
    ++statistics.patches;
    statistics.candidate_points += candidates_.size();
    statistics.area += touch_ ? 0 : std::fabs(area_.dot(normal_));
    for (std::uint32_t c = 0; c < count; ++c)
      statistics.open_curves += kept_[c] != 0 && !curves.curves()[c].closed;
    for (const Chosen& c : chosen_) {
      points.push_back({bodies.a, bodies.b, frame_.at(c.x, c.height), normal_, c.depth,
                        feature_hash(std::uint64_t{bodies.a} << 32 | bodies.b, c.feature)});
      statistics.depth = std::max(statistics.depth, c.depth);
    }
    statistics.points += chosen_.size();
  }
}

}  // namespace tandem::simulation
