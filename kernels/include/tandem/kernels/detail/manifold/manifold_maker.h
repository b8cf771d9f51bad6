#pragma once
#include "tandem/kernels/detail/manifold/patch_normal.h"
#include "tandem/kernels/detail/manifold/patch_rim.h"

/// The rule by which contacts become manifolds (docs/contacts.md), for CPU and GPU alike.
namespace tandem::manifold {

/// How far a line that sounds the depth at the rim is moved inwards, as a part of the way to the middle, so
/// that it does not run along a wall that made the rim.
inline constexpr double kInwards = 0.02;

/// Points of a manifold closer than this part of the smaller body's diagonal are one.
inline constexpr double kNear = 0.005;

/// An inner point is kept where it lies deeper than the rim by this factor.
inline constexpr double kDeeper = 1.25;

/// In patches of so few pieces the corners of their triangles are looked at for the deepest point.
inline constexpr std::uint32_t kFewPieces = 64;

template <typename Team>
class ManifoldMaker {
 public:
  TANDEM_HD ManifoldMaker(const Team& team, const BodyPair& bodies, const PieceMemory& memory,
                          PatchMemory& shared, const PieceSummary& summary, int most_points)
      : team_(team),
        bodies_(bodies),
        memory_(memory),
        shared_(shared),
        summary_(summary),
        most_points_(most_points) {}

  /// Makes the patch of a curve that CurveFinder found, whose summary this is. new_patch(): where it is to
  /// lie, or null; called by one of the team if there is one. False: an ambiguous touch.
  template <typename NewPatch>
  TANDEM_HD bool make(std::uint32_t curve, const NewPatch& new_patch);

 private:
  struct Chosen {
    Vector2 at;
    double height, depth, from_middle;
    std::uint64_t feature;
    std::uint32_t triangle[2];
    bool inner;
  };

  TANDEM_HD void place_soundings(const RimFinder<Team>& finder, const Rim& rim, const PatchFrame& frame,
                                 bool touch);
  TANDEM_HD void walk_lines(LineQuestions& questions, std::uint32_t count);
  TANDEM_HD void sound(const PatchFrame& frame, int first, int count);
  TANDEM_HD void sound_deepest(const PatchFrame& frame, const Rim& rim, std::uint32_t curve);
  TANDEM_HD Extreme extreme_corner(const PatchFrame& frame, std::uint32_t begin, std::uint32_t end,
                                   int side) const;
  TANDEM_HD void look_behind(const PatchFrame& frame);
  TANDEM_HD int choose(const RimFinder<Team>& finder, int most_of_rim, bool touch,
                       Chosen (&chosen)[kMostSoundings]) const;

  const Team& team_;
  const BodyPair& bodies_;
  PieceMemory memory_;
  PatchMemory& shared_;
  const PieceSummary& summary_;
  int most_points_;
  Vector2 middle_;     // of the rim
  double extent_ = 0;  // of the rim, from its middle
  int rim_points_ = 0, soundings_ = 0;
};

/// The rim as it is sounded, and the middle.
template <typename Team>
TANDEM_HD void ManifoldMaker<Team>::place_soundings(const RimFinder<Team>& finder, const Rim& rim,
                                                    const PatchFrame& frame, bool touch) {
  Vector2 at[kMostManifoldPoints];
  double height[kMostManifoldPoints], mean_height = 0;
  middle_ = {};
  for (int i = 0; i < rim.points; ++i) {
    const Vector3 x = finder.position(rim.reference[i]);
    at[i] = frame.flat(x), height[i] = frame.height(x);
    middle_ = middle_ + at[i];
    mean_height += height[i];
  }
  middle_ = (1.0 / rim.points) * middle_;
  mean_height /= rim.points;
  extent_ = 0;
  for (int i = 0; i < rim.points; ++i) extent_ = std::fmax(extent_, norm(at[i] - middle_));
  rim_points_ = rim.points;
  soundings_ = touch ? rim.points : rim.points + 1;
  if (team_.rank() == 0) {
    for (int i = 0; i < soundings_; ++i) {
      Sounding& s = shared_.sounding[i];
      s = {};
      const bool inner = i == rim.points;
      s.at = inner ? middle_ : at[i];
      s.line = inner ? middle_ : at[i] + kInwards * (middle_ - at[i]);
      s.height = s.target[0] = s.target[1] = inner ? mean_height : height[i];
      s.reference = inner ? kNoIndex : rim.reference[i];
      s.rank = inner ? 0 : rim.rank[i];
      s.feature = feature_hash(0, 4);
    }
  }
  team_.sync();
}

/// Answers the first `count` line questions; those of no side were not asked. By the crew.
template <typename Team>
TANDEM_HD void ManifoldMaker<Team>::walk_lines(LineQuestions& questions, std::uint32_t count) {
  WalkMemory& walk = shared_.walk;
  for (bool further = false;; further = true) {
    team_.crew_sync();  // all have read what the last walk left
    if (team_.rank() == 0) team_.store(walk.count, 0);
    team_.crew_sync();
    for (std::uint32_t i = team_.rank(); i < count; i += team_.crew_size()) {
      if (shared_.line[i].side < 0 || (further && !questions.look_further(i))) continue;
      walk.waiting[team_.add(walk.count, 1)] = std::uint64_t{i} << 32;
    }
    team_.crew_sync();
    if (team_.load(walk.count) == 0) return;
    walk_surfaces(team_, walk, questions);
    if (further) return;
  }
}

template <typename Team>
TANDEM_HD void ManifoldMaker<Team>::sound(const PatchFrame& frame, int first, int count) {
  LineQuestions questions(bodies_, frame, shared_.line);
  const auto asked = 2 * static_cast<std::uint32_t>(count);
  if (team_.in_crew()) {
    for (std::uint32_t i = team_.rank(); i < asked; i += team_.crew_size()) {
      const Sounding& s = shared_.sounding[first + static_cast<int>(i / 2)];
      const int side = static_cast<int>(i % 2);
      questions.ask(i, side, side == 0 ? 1 : -1, s.line, s.target[side], -INFINITY, INFINITY, extent_ / 4);
    }
    team_.crew_sync();
    walk_lines(questions, asked);
    for (std::uint32_t i = team_.rank(); i < asked; i += team_.crew_size())
      shared_.sounding[first + static_cast<int>(i / 2)].surface[i % 2] = shared_.line[i].best;
  }
  team_.sync();
}

/// The highest corner of a's triangles of the curve, or the lowest of b's; of several the vertex of the least
/// number.
template <typename Team>
TANDEM_HD Extreme ManifoldMaker<Team>::extreme_corner(const PatchFrame& frame, std::uint32_t begin,
                                                      std::uint32_t end, int side) const {
  Extreme best;
  const auto question = static_cast<std::uint32_t>(side);
  for (std::uint32_t i = begin + team_.rank(); i < end; i += team_.size()) {
    const std::uint32_t t = memory_.pieces[memory_.order[i]].triangle[side];
    for (int k = 0; k < 3; ++k) {
      const Vector3 x = bodies_[side].corner(t, k);
      const Extreme here = {frame.flat(x), frame.height(x), bodies_[side].shape->topology[t].vertex[k]};
      if (ExtremeQuestions::is_further(question, here, best)) best = here;
    }
  }
  const double along = !best.found() ? -INFINITY : side == 0 ? best.height : -best.height;
  const double furthest = team_.greatest(along);
  const std::uint32_t vertex = team_.least(along == furthest ? best.vertex : kNoIndex);
  const bool mine = best.vertex == vertex;
  // A vertex is posed to the same bits from each of its triangles.
  return {{team_.greatest(mine ? best.at.x : -INFINITY), team_.greatest(mine ? best.at.y : -INFINITY)},
          side == 0 ? furthest : -furthest,
          vertex};
}

/// Sounds where a's highest vertex in the patch is, and b's lowest: there, or in the middle, the overlap is
/// deepest, or nearly. They are looked for beyond what lines have met, within the rim, and no further along
/// the normal than the rim and the middle are from each other's surfaces, and the rim's extent more; and
/// among the corners of triangles that the curve cuts, where they are few: the tip of a coarse mesh may lean
/// out of its rim.
template <typename Team>
TANDEM_HD void ManifoldMaker<Team>::sound_deepest(const PatchFrame& frame, const Rim& rim,
                                                  std::uint32_t curve) {
  Prism prism;
  prism.frame = frame;
  const double more = 1e-6 * extent_ + 0x1p-40 * bodies_.reach();
  for (int i = 0; i < rim.points; ++i) {
    const Vector2 p = shared_.sounding[i].at, q = shared_.sounding[i + 1 == rim.points ? 0 : i + 1].at;
    const double length = norm(q - p);
    if (!(length > 0)) continue;
    Vector2& outward = prism.outward[prism.sides];
    outward = (1 / length) * Vector2{q.y - p.y, p.x - q.x};
    prism.offset[prism.sides++] = dot(outward, p) + more;
  }
  double lowest = INFINITY, highest = -INFINITY;
  prism.above_a = -INFINITY, prism.below_b = INFINITY;
  for (int i = 0; i < soundings_; ++i) {
    const Sounding& s = shared_.sounding[i];
    lowest = std::fmin(lowest, s.height), highest = std::fmax(highest, s.height);
    if (!(s.overlap() > 0)) continue;
    lowest = std::fmin(lowest, s.surface[1].height), highest = std::fmax(highest, s.surface[0].height);
    prism.above_a = std::fmax(prism.above_a, s.surface[0].height);
    prism.below_b = std::fmin(prism.below_b, s.surface[1].height);
  }
  prism.lower = lowest - extent_, prism.upper = highest + extent_;
  if (team_.in_crew()) {
    ExtremeQuestions questions(bodies_, prism, shared_.prism_test, shared_.extreme);
    WalkMemory& walk = shared_.walk;
    for (std::uint32_t side = team_.rank(); side < 2; side += team_.crew_size()) {
      questions.ask(side);
      walk.waiting[side] = std::uint64_t{side} << 32;
    }
    if (team_.rank() == 0) team_.store(walk.count, 2);
    team_.crew_sync();
    walk_surfaces(team_, walk, questions);
  }
  const std::uint32_t begin = memory_.start[curve], end = memory_.start[curve + 1];
  const bool few = end - begin <= kFewPieces;
  for (int side = 0; few && side < 2; ++side) {
    const Extreme corner = extreme_corner(frame, begin, end, side);
    if (team_.rank() == 0) shared_.extreme[2 + side] = corner;
  }
  team_.sync();
  const int first = soundings_;
  for (int i = 0; i < (few ? 4 : 2); ++i) {
    const int side = i % 2;
    const Extreme& extreme = shared_.extreme[i];
    if (!extreme.found() || (i >= 2 && extreme.vertex == shared_.extreme[side].vertex)) continue;
    if (team_.rank() == 0) {
      Sounding& s = shared_.sounding[soundings_];
      s = {};
      s.at = s.line = extreme.at;
      s.height = extreme.height;
      s.target[side] = extreme.height;
      s.target[1 - side] = shared_.sounding[rim_points_].height;
      s.reference = kNoIndex;
      s.vertex_of = side;
      s.feature = feature_hash(extreme.vertex, side == 0 ? 5 : 6);
    }
    ++soundings_;
  }
  team_.sync();
  sound(frame, first, soundings_ - first);
}

/// Looks whether lines that seem to overlap run within both bodies: where there are several curves, one may
/// bound a hole, or one body may go through the other; and where the overlap is large beside the rim, the
/// surfaces that the line found may not belong to the patch. A vertex is part of its own body: the line may
/// touch that no further.
template <typename Team>
TANDEM_HD void ManifoldMaker<Team>::look_behind(const PatchFrame& frame) {
  const bool several = summary_.curves > 1;
  LineQuestions questions(bodies_, frame, shared_.line);
  const auto asked = 2 * static_cast<std::uint32_t>(soundings_);
  if (team_.in_crew()) {
    for (std::uint32_t i = team_.rank(); i < asked; i += team_.crew_size()) {
      Sounding& s = shared_.sounding[i / 2];
      const int side = static_cast<int>(i % 2);
      const bool wanted = s.overlap() > (several ? 0 : extent_ / 2);
      if (wanted && side == 0) s.looked_behind = true;
      shared_.line[i].side = -1;
      if (!wanted || side == s.vertex_of) continue;
      questions.ask(i, side, side == 0 ? -1 : 1, s.line, s.surface[side].height, s.surface[1].height,
                    s.surface[0].height, INFINITY);
    }
    team_.crew_sync();
    walk_lines(questions, asked);
    for (std::uint32_t i = team_.rank(); i < asked; i += team_.crew_size()) {
      if (shared_.line[i].side >= 0) shared_.sounding[i / 2].behind[i % 2] = shared_.line[i].best;
    }
  }
  team_.sync();
}

/// The first points of the rim as it is sounded, and the deepest inner point where it lies deeper. Deeper
/// points come first, then those further out; of points near each other the first stays.
template <typename Team>
TANDEM_HD int ManifoldMaker<Team>::choose(const RimFinder<Team>& finder, int most_of_rim, bool touch,
                                          Chosen (&chosen)[kMostSoundings]) const {
  int count = 0;
  double of_rim = 0;
  Chosen inner{};
  for (int i = 0; i < soundings_; ++i) {
    const Sounding& s = shared_.sounding[i];
    Chosen c{};
    c.at = s.at;
    c.depth = !touch && s.within() ? s.overlap() : 0;
    c.height = c.depth > 0 ? (s.surface[0].height + s.surface[1].height) / 2 : s.height;
    c.from_middle = norm(s.at - middle_);
    c.inner = s.reference == kNoIndex;
    if (c.inner) {
      c.feature = s.feature;
      c.triangle[0] = s.surface[0].triangle, c.triangle[1] = s.surface[1].triangle;
      if (c.depth > inner.depth) inner = c;
      continue;
    }
    if (s.rank >= most_of_rim) continue;
    c.feature = finder.feature(s.reference);
    const Piece& piece = finder.piece(s.reference);
    c.triangle[0] = piece.triangle[0], c.triangle[1] = piece.triangle[1];
    of_rim = std::fmax(of_rim, c.depth);
    chosen[count++] = c;
  }
  if (inner.depth > kDeeper * of_rim) chosen[count++] = inner;
  for (int i = 1; i < count; ++i) {  // stable
    const Chosen c = chosen[i];
    int j = i;
    for (; j > 0; --j) {
      const Chosen& before = chosen[j - 1];
      if (!(c.depth > before.depth || (c.depth == before.depth && c.from_middle > before.from_middle))) break;
      chosen[j] = before;
    }
    chosen[j] = c;
  }
  const double near = kNear * bodies_.smaller_diagonal();
  int kept = 0;
  for (int i = 0; i < count; ++i) {
    bool alone = true;
    for (int k = 0; k < kept; ++k) alone = alone && norm(chosen[k].at - chosen[i].at) >= near;
    if (alone) chosen[kept++] = chosen[i];
  }
  return kept;
}

template <typename Team>
template <typename NewPatch>
TANDEM_HD bool ManifoldMaker<Team>::make(std::uint32_t curve, const NewPatch& new_patch) {
  team_.sync();  // all are done with what the last curve left
  NormalFinder<Team> normal_finder(team_, bodies_, memory_, summary_, curve);
  const CurveMeasure measure = normal_finder.measure();
  const PatchNormal normal = normal_finder.find(measure);
  if (!normal.known) return false;
  const PatchFrame frame(summary_.origin, normal.n);
  RimFinder<Team> rim_finder(team_, bodies_, memory_, summary_, curve, frame);
  rim_finder.gather(measure.closed && !summary_.degenerate, shared_.next);
  // One is left for an inner point. What the patch is does not depend on how many points it may have.
  const int most_of_rim = normal.touch || most_points_ == 1 ? most_points_ : most_points_ - 1;
  const Rim rim = rim_finder.find(kMostManifoldPoints - (normal.touch ? 0 : 1), frame.flat(measure.middle));
  if (rim.points == 0) return false;
  place_soundings(rim_finder, rim, frame, normal.touch);
  bool goes_through = false, hole = false;
  if (!normal.touch) {
    sound(frame, 0, soundings_);
    sound_deepest(frame, rim, curve);
    look_behind(frame);
    if (summary_.curves > 1 && measure.closed) {
      double deepest = 0;
      // No line is within the bodies, nor so short that rounding hides it.
      hole = true;
      const double rounding = 0x1p-40 * bodies_.reach();
      for (int i = 0; i <= rim_points_; ++i) {
        const Sounding& s = shared_.sounding[i];
        const bool seen = s.surface[0].found() && s.surface[1].found();
        hole = hole && !s.within() && !(seen && std::fabs(s.overlap()) <= rounding);
        if (!s.within() || s.overlap() <= deepest) continue;
        deepest = s.overlap();
        goes_through = s.goes_through();
      }
      // The way back is the shorter one on the side where the middles are.
      if (goes_through && dot(measure.area, bodies_.apart()) < 0) return true;
    }
  }
  Chosen chosen[kMostSoundings];
  int count = choose(rim_finder, most_of_rim, normal.touch || hole, chosen);
  count = count < most_points_ ? count : most_points_;
  const double near = kNear * bodies_.smaller_diagonal();
  for (int i = 0; i < count; ++i) {
    // The middle, and a vertex that is deepest in two patches, are told apart by the patch.
    std::uint64_t& feature = chosen[i].feature;
    feature = chosen[i].inner ? feature_hash(feature, measure.key)
                              : rim_finder.least_feature_near(chosen[i].at, near / 2, feature);
    // Far from the origin, where tolerance() is as large as triangles, one feature may be at two places.
    for (int k = 0; k < i; ++k) {
      if (chosen[k].feature == feature) feature = feature_hash(feature, 10 + static_cast<std::uint64_t>(i));
    }
  }
  if (team_.rank() != 0) return true;
  Patch* const patch = new_patch();
  if (patch == nullptr) return true;
  Vector2 centre = middle_;
  double deepest = 0, height = 0;
  for (int i = 0; i < count; ++i) height += chosen[i].height / count;
  for (int i = 0; i < soundings_ && !normal.touch && !hole; ++i) {
    const Sounding& s = shared_.sounding[i];
    if (s.within()) deepest = std::fmax(deepest, s.overlap());
  }
  if (measure.closed && !normal.touch) {
    Vector2 of_area;
    if (rim_finder.middle_of_area(of_area) && norm(of_area - middle_) <= extent_) centre = of_area;
  }
  Vector3 area = measure.area;
  if (!measure.closed) {
    // The curve bounds no area: that of the rim stands in.
    double twice = 0;
    for (int i = 1; i + 1 < rim.points; ++i) {
      const Vector2 p = shared_.sounding[0].at;
      twice += cross(shared_.sounding[i].at - p, shared_.sounding[i + 1].at - p);
    }
    area = (std::fabs(twice) / 2) * normal.n;
  }
  if (normal.touch) area = {};
  const auto write = [](const Vector3& x, double(&out)[3]) { out[0] = x.x, out[1] = x.y, out[2] = x.z; };
  Manifold& manifold = patch->manifold;
  manifold = {};
  write(normal.n, manifold.normal);
  write(area, manifold.area_vector);
  write(frame.at(centre, height), manifold.centre);
  manifold.depth = deepest;
  manifold.point_count = static_cast<std::uint32_t>(count);
  manifold.flags = (normal.touch ? kTouching : 0u) | (measure.closed ? 0u : kOpenCurve) |
                   (goes_through ? kGoesThrough : 0u);
  patch->key = measure.key;
  patch->hole = hole ? 1 : 0;
  for (int i = 0; i < count; ++i) {
    const Chosen& c = chosen[i];
    ManifoldPoint& point = patch->point[i];
    const Vector3 x = frame.at(c.at, c.height), half = (c.depth / 2) * normal.n;
    write(x, point.position);
    write(bodies_.a.in_file_coordinates(x + half), point.in_a);
    write(bodies_.b.in_file_coordinates(x - half), point.in_b);
    point.depth = c.depth;
    point.id = c.feature;
    point.face_a = bodies_.a.shape->triangles[c.triangle[0]].source_face();
    point.face_b = bodies_.b.shape->triangles[c.triangle[1]].source_face();
    point.previous = kNoIndex;
    point.manifold = kNoIndex;
  }
  return true;
}

}  // namespace tandem::manifold
