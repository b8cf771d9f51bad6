#include "contact_patch.h"

#include <algorithm>
#include <cmath>

namespace tandem::simulation {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

// How far a line that sounds the depth at the rim is moved inwards, as a part of the way to the middle, so
// that it does not run along a wall that made the rim.
constexpr double kInwards = 0.02;

// How far beside a line a triangle may lie that stands in where the line hits none, as a part of the patch's
// extent. Little is amiss but where corners of one body lie in faces of the other: rounding may keep
// triangles of a whole side out of the contacts, and then any in the patch stands in.
constexpr double kBeside = 0.1, kBesideDegenerate = 2;

// Points of a patch closer than this part of the smaller body's diagonal are one.
constexpr double kNear = 0.005;

// Corners of the rim that make less than this part of its area are left out.
constexpr double kLittle = 1e-4;

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

}  // namespace

// Of several curves around one region, those whose area vectors oppose each other go through a body: then
// only those count that push the bodies to the sides on which their middles are.
void ContactPatches::keep_curves(std::uint32_t group) {
  region_.current = group;
  const auto curves = region_.curves->curves();
  Vector3d sum = Vector3d::Zero();
  double sizes = 0;
  std::size_t members = 0;
  for (std::size_t i = 0; i < curves.size(); ++i) {
    region_.kept[i] = region_.in_group(static_cast<std::uint32_t>(i));
    if (region_.kept[i] == 0) continue;
    sum += curves[i].area;
    sizes += curves[i].area.norm();
    ++members;
  }
  if (members < 2 || sum.norm() >= sizes / 2) return;
  const Vector3d apart = region_.apart();
  const auto agrees = [&](std::size_t i) { return region_.kept[i] != 0 && curves[i].area.dot(apart) > 0; };
  bool any = false;
  for (std::size_t i = 0; i < curves.size(); ++i) any = any || agrees(i);
  for (std::size_t i = 0; any && i < curves.size(); ++i) region_.kept[i] = agrees(i);
}

void ContactPatches::gather_candidates() {
  candidates_.clear();
  const auto pieces = region_.curves->pieces();
  for (const CurvePiece& piece : pieces) {
    if (!region_.in_patch(piece.curve)) continue;
    const std::uint64_t both = std::uint64_t{piece.triangle[0]} << 32 | piece.triangle[1];
    if (piece.kind == Meeting::Kind::polygon) {
      std::uint64_t corner = 8;
      if (piece.facing) {
        for (const Vector3d& x : region_.curves->corners(piece)) {
          candidates_.push_back({x, feature_hash(both, corner++)});
        }
      }
      continue;
    }
    // Closed curves have each end twice.
    const Curve& curve = region_.curves->curves()[piece.curve];
    const int ends = curve.closed && !curve.degenerate ? 1 : 2;
    for (int end = 0; end < ends; ++end) {
      const TriangleFeature& f = piece.feature[end];
      const Surface& own = region_.side[f.of_b ? 1 : 0]->shape().surface;
      const std::uint32_t t = piece.triangle[f.of_b ? 1 : 0];
      const std::uint64_t number = f.is_corner ? own.corner[t][f.number] : own.edge_of[t][f.number];
      const std::uint64_t key = number << 32 | piece.triangle[f.of_b ? 0 : 1];
      candidates_.push_back(
          {piece.end[end], feature_hash(key, (f.of_b ? 2u : 0u) + (f.is_corner ? 1u : 0u))});
    }
  }
}

// The corners of the hull of all candidates.
void ContactPatches::gather_rim(std::size_t most) {
  const PatchFrame& frame = frame_;
  flat_.clear();
  for (std::uint32_t i = 0; i < candidates_.size(); ++i) flat_.push_back({frame.flat(candidates_[i].x), i});
  convex_hull(flat_, hull_);
  simplify_hull(hull_, most, kLittle);
  Vector2d middle = Vector2d::Zero();
  for (const PlanePoint& p : hull_) middle += p.x / static_cast<double>(hull_.size());
  double extent = 0;
  for (const PlanePoint& p : hull_) extent = std::max(extent, (p.x - middle).norm());
  const auto curves = region_.curves->curves();
  const bool degenerate =
      std::any_of(curves.begin(), curves.end(), [](const Curve& curve) { return curve.degenerate; });
  nearest_ = (degenerate ? kBesideDegenerate : kBeside) * extent;
  for (const PlanePoint& p : hull_) {
    const Candidate& candidate = candidates_[p.index];
    depth_.add(p.x, p.x + kInwards * (middle - p.x), frame.height(candidate.x), candidate.feature, false,
               nearest_);
  }
}

// b's lowest enclosed vertex, a's highest, and the middle of the rim: at one of them the overlap is largest,
// or nearly.
void ContactPatches::gather_inner() {
  Vector2d middle = Vector2d::Zero();
  double height = 0;
  const auto rim = static_cast<double>(depth_.soundings.size());
  for (const Sounding& s : depth_.soundings) middle += s.at / rim, height += s.height / rim;
  for (const int side : {0, 1}) {
    const double upwards = side == 0 ? 1 : -1;
    const BodySide::Enclosed* extreme = nullptr;
    double reach = 0;
    for (const BodySide::Enclosed& v : region_.side[side]->enclosed()) {
      if (!region_.in_group(v.curve)) continue;
      const double of_v = upwards * frame_.height(v.position);
      if (extreme == nullptr || of_v > reach) extreme = &v, reach = of_v;
    }
    if (extreme == nullptr) continue;
    const Vector2d x = frame_.flat(extreme->position);
    depth_.add(x, x, upwards * reach, feature_hash(extreme->vertex, side == 0 ? 5 : 6), true, nearest_);
  }
  depth_.add(middle, middle, height, feature_hash(region_.current, 4), true, nearest_);
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

// The rim as it is sounded, and the deepest inner point where it lies deeper.
void ContactPatches::choose_points(std::size_t most) {
  const bool touch = normal_.is_touch();
  depth_.start(frame_);
  gather_rim(std::max<std::size_t>(most, 2) - (touch ? 0 : 1));
  if (!touch) {
    gather_inner();
    depth_.sound(region_);
  }
  chosen_.clear();
  const auto chosen = [&](const Sounding& s) {
    const double depth = std::clamp(s.surface[0] - s.surface[1], 0.0, normal_.separation());
    const double height = depth > 0 ? (s.surface[0] + s.surface[1]) / 2 : s.height;
    return Chosen{s.at, height, depth, s.feature, s.inner};
  };
  Chosen inner = {Vector2d::Zero(), 0, 0, 0, true};
  double of_rim = 0;
  for (const Sounding& s : depth_.soundings) {
    const Chosen c = chosen(s);
    if (s.inner) {
      if (c.depth > inner.depth) inner = c;
      continue;
    }
    chosen_.push_back(c);
    of_rim = std::max(of_rim, c.depth);
  }
  if (inner.depth > kDeeper * of_rim) chosen_.push_back(inner);
  const double near = kNear * std::min(region_.side[0]->shape().diagonal, region_.side[1]->shape().diagonal);
  merge_near(near);
  if (chosen_.size() > most) chosen_.resize(most);
  name_points(near / 2);
}

void ContactPatches::add_patch(const ObjectPair& bodies, const ContactOptions& options,
                               std::vector<ContactPoint>& points, ContactStatistics& statistics) {
  gather_candidates();
  if (candidates_.empty() || !normal_.choose(region_)) {
    ++statistics.ambiguous_touches;
    return;
  }
  frame_ = PatchFrame(candidates_[0].x, normal_.normal());
  choose_points(options.points_per_patch);
  ++statistics.patches;
  statistics.candidate_points += candidates_.size();
  statistics.area += normal_.area();
  const auto curves = region_.curves->curves();
  for (std::uint32_t c = 0; c < curves.size(); ++c) {
    statistics.open_curves += region_.in_patch(c) && !curves[c].closed;
  }
  for (const Chosen& c : chosen_) {
    points.push_back({bodies.a, bodies.b, frame_.at(c.x, c.height), frame_.n, c.depth,
                      feature_hash(std::uint64_t{bodies.a} << 32 | bodies.b, c.feature)});
    statistics.depth = std::max(statistics.depth, c.depth);
  }
  statistics.points += chosen_.size();
}

void ContactPatches::add(ContactCurves& curves, const BodySide& a, const BodySide& b,
                         const ObjectPair& bodies, const ContactOptions& options,
                         std::vector<ContactPoint>& points, ContactStatistics& statistics) {
  const auto count = static_cast<std::uint32_t>(curves.curves().size());
  region_.curves = &curves;
  region_.side[0] = &a, region_.side[1] = &b;
  region_.kept.assign(count, 0);
  region_.group.resize(count);
  for (std::uint32_t i = 0; i < count; ++i) region_.group[i] = curves.group_of(i);
  statistics.segments += curves.segments();
  for (std::uint32_t i = 0; i < count; ++i) {
    if (region_.group[i] != i) continue;
    keep_curves(i);
    add_patch(bodies, options, points, statistics);
  }
}

}  // namespace tandem::simulation
