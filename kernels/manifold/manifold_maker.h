#pragma once
#include "kernels/manifold/patch_normal.h"
#include "kernels/manifold/patch_rim.h"

/// The rule by which contacts become manifolds (docs/contacts.md), for CPU and GPU alike.
namespace tandem::manifold {

/// A line that sounds the depth at the rim is moved inwards by this part of the way to the middle, so that it
/// does not run along a wall that made the rim.
inline constexpr double kInwards = 0.02;

/// Points of a manifold closer than this part of the smaller body's diagonal are one.
inline constexpr double kNear = 0.005;

/// An inner point is kept where it lies deeper than the rim by this factor.
inline constexpr double kDeeper = 1.25;

/// A rim point near the deepest inner point has its depth where that is larger by a factor between these:
/// less is rounding and the lean of the surface beside the point, more is another place.
inline constexpr double kLittleDeeper = 1.01, kSomewhatDeeper = 1.1;

/// If a patch has so few pieces, the corners of their triangles are looked at for the deepest point.
inline constexpr std::uint32_t kFewPieces = 64;

/// Makes the patch of a curve that CurveFinder found, whose summary this is, in three steps. A patch's state
/// is all that they hand on to each other.
template <typename Team>
class ManifoldMaker {
 public:
  TANDEM_HD ManifoldMaker(const Team& team, const BodyPair& bodies, const PieceMemory& memory,
                          const PieceSummary& summary, PatchState& state)
      : team_(team), bodies_(bodies), memory_(memory), summary_(summary), state_(state) {}

  /// Normal and rim. False: an ambiguous touch, which has no patch.
  TANDEM_HD bool begin(std::uint32_t curve, OutlineMemory& shared);

  /// Depths.
  TANDEM_HD void measure_depths(std::uint32_t curve, DepthMemory& shared);

  /// Points. new_patch(): where the patch is to lie, or null; called by one of the team if there is one.
  template <typename NewPatch>
  TANDEM_HD void finish(std::uint32_t curve, int most_points, ChoiceMemory& shared,
                        const NewPatch& new_patch);

 private:
  TANDEM_HD void place_soundings(const RimFinder<Team>& finder, const Rim& rim);
  TANDEM_HD void walk_lines(LineQuestions& questions, std::uint32_t count, DepthMemory& shared);
  TANDEM_HD void sound(int first, int end, std::uint32_t which, DepthMemory& shared);
  TANDEM_HD void place_prism(DepthMemory& shared);
  TANDEM_HD void find_extreme_corners(std::uint32_t curve, DepthMemory& shared);
  TANDEM_HD void place_vertex(int at, int side, const Extreme& vertex, double height_of_middle);
  TANDEM_HD void sound_rim(bool few, std::uint32_t curve, DepthMemory& shared);
  TANDEM_HD void sound_deepest(bool few, DepthMemory& shared);
  TANDEM_HD void look_behind(DepthMemory& shared);
  TANDEM_HD void choose(const RimFinder<Team>& finder, int most_of_rim, bool touch, ChoiceMemory& shared);
  TANDEM_HD void place_candidates(const RimFinder<Team>& finder, bool touch, ChoiceMemory& shared);
  TANDEM_HD int much_deeper_inner_point(int most_of_rim, ChoiceMemory& shared) const;
  TANDEM_HD void keep_apart(int most_of_rim, int inner, ChoiceMemory& shared) const;
  /// Returns whether a sounding is one of the first points of the rim.
  TANDEM_HD bool is_of_rim(int i, int most_of_rim, const ChoiceMemory& shared) const {
    return !shared.candidate[i].inner && state_.sounding[i].rank < most_of_rim;
  }
  TANDEM_HD void write_points(const ChoiceMemory& shared, Patch& patch, int count) const;
  TANDEM_HD void write_manifold(const ChoiceMemory& shared, Patch& patch, int count, bool hole,
                                bool goes_through) const;

  const Team& team_;
  const BodyPair& bodies_;
  PieceMemory memory_;
  const PieceSummary& summary_;
  PatchState& state_;
};

/// The rim as it is sounded, and the middle.
template <typename Team>
TANDEM_HD void ManifoldMaker<Team>::place_soundings(const RimFinder<Team>& finder, const Rim& rim) {
  const PatchFrame& frame = state_.frame;
  Vector2 middle;
  double mean_height = 0, extent = 0;
  for (int i = 0; i < rim.points; ++i) {
    const Vector3 x = finder.position(rim.reference[i]);
    middle = middle + frame.flat(x);
    mean_height += frame.height(x);
  }
  middle = (1.0 / rim.points) * middle;
  mean_height /= rim.points;
  for (int i = 0; i < rim.points; ++i)
    extent = greater(extent, norm(frame.flat(finder.position(rim.reference[i])) - middle));
  const int soundings = state_.touch ? rim.points : rim.points + 1;
  for (int i = static_cast<int>(team_.rank()); i < soundings; i += static_cast<int>(team_.size())) {
    Sounding& s = state_.sounding[i];
    s = {};
    const bool inner = i == rim.points;
    const Vector3 x = finder.position(rim.reference[inner ? 0 : i]);
    s.at = inner ? middle : frame.flat(x);
    s.line = inner ? middle : s.at + kInwards * (middle - s.at);
    s.height = inner ? mean_height : frame.height(x);
    s.target[0] = s.target[1] = s.height;
    s.reference = inner ? kNoIndex : rim.reference[i];
    s.rank = inner ? 0 : rim.rank[i];
    s.feature = inner ? feature_hash(0, 4) : finder.feature(rim.reference[i]);
  }
  if (team_.rank() == 0) {
    state_.rim_points = rim.points, state_.soundings = soundings;
    state_.middle = state_.middle_of_area = middle;
    state_.extent = extent;
    Vector2 of_area;
    if (finder.middle_of_area(of_area) && norm(of_area - middle) <= extent) state_.middle_of_area = of_area;
    state_.candidates = finder.count();
  }
  team_.sync();
}

/// Answers the first `count` line questions; those of no side were not asked.
template <typename Team>
TANDEM_HD void ManifoldMaker<Team>::walk_lines(LineQuestions& questions, std::uint32_t count,
                                               DepthMemory& shared) {
  if constexpr (HasLanes<Team>) return questions.answer(team_.lanes(), count);
  constexpr int kLinesWidth = 8;
  team_.sync();
  team_.template for_each_group<kLinesWidth>(count, [&](const auto& group, std::uint32_t i, bool given) {
    const bool asked = given && shared.line[i].side >= 0;
    if (asked && group.rank() == 0) questions.prepare(i);
    walk_surface(group, questions, i, asked);
    const bool further = asked && questions.has_to_look_further(i);
    group.sync();
    if (further && group.rank() == 0) questions.look_further(i);
    walk_surface(group, questions, i, further);
  });
  team_.sync();
}

/// Follows the lines of soundings from `first` on, of those below `end` whose bits are set.
template <typename Team>
TANDEM_HD void ManifoldMaker<Team>::sound(int first, int end, std::uint32_t which, DepthMemory& shared) {
  LineQuestions questions(bodies_, state_.frame, shared.line);
  const auto count = 2 * static_cast<std::uint32_t>(end - first);
  for (std::uint32_t i = team_.rank(); i < count; i += team_.size()) {
    const int at = first + static_cast<int>(i / 2), side = static_cast<int>(i % 2);
    const Sounding& s = state_.sounding[at];
    shared.line[i].side = -1;
    if ((which >> at & 1u) == 0) continue;
    questions.ask(i, side, side == 0 ? 1 : -1, s.line, s.target[side], -INFINITY, INFINITY,
                  state_.extent / 4);
  }
  walk_lines(questions, count, shared);
  for (std::uint32_t i = team_.rank(); i < count; i += team_.size()) {
    if (shared.line[i].side >= 0)
      state_.sounding[first + static_cast<int>(i / 2)].surface[i % 2] = shared.line[i].best;
  }
  team_.sync();
}

/// The part of space in which the deepest vertices are looked for: beyond what lines have met, within the
/// rim, and no further along the normal than the rim and the middle are from each other's surfaces, and the
/// rim's extent more.
template <typename Team>
TANDEM_HD void ManifoldMaker<Team>::place_prism(DepthMemory& shared) {
  Prism& prism = shared.prism;
  const double more = 1e-6 * state_.extent + 0x1p-40 * bodies_.reach();
  const auto corner = [&](int i) { return state_.sounding[i == state_.rim_points ? 0 : i].at; };
  const int rank = static_cast<int>(team_.rank()), size = static_cast<int>(team_.size());
  for (int i = rank; i < state_.rim_points; i += size) {
    const Vector2 p = corner(i), q = corner(i + 1);
    const double length = norm(q - p);
    prism.outward[i] = length > 0 ? (1 / length) * Vector2{q.y - p.y, p.x - q.x} : Vector2{};
    prism.offset[i] = dot(prism.outward[i], p) + more;
  }
  for (int k = rank; k < 2; k += size) {
    Vector2 ends[2] = {};  // the rim's first two corners: nearly its longest way across
    for (int i = 0; i < state_.rim_points; ++i) {
      if (state_.sounding[i].rank < 2) ends[state_.sounding[i].rank] = state_.sounding[i].at;
    }
    const double length = norm(ends[1] - ends[0]);
    const Vector2 along = length > 0 ? (1 / length) * (ends[1] - ends[0]) : Vector2{1, 0};
    prism.axis[k] = k == 0 ? along : Vector2{-along.y, along.x};
    double least = INFINITY, most = -INFINITY;
    for (int i = 0; i < state_.rim_points; ++i) {
      const double x = dot(prism.axis[k], corner(i));
      least = lesser(least, x), most = greater(most, x);
    }
    prism.least[k] = least - 2 * more, prism.most[k] = most + 2 * more;
  }
  if (rank == 0) {
    prism.frame = state_.frame;
    prism.sides = state_.rim_points;
    double lowest = INFINITY, highest = -INFINITY, above_a = -INFINITY, below_b = INFINITY;
    for (int i = 0; i <= state_.rim_points; ++i) {
      const Sounding& s = state_.sounding[i];
      lowest = lesser(lowest, s.height), highest = greater(highest, s.height);
      if (!(s.overlap() > 0)) continue;
      const double of_a = s.surface[0].height, of_b = s.surface[1].height;
      lowest = lesser(lowest, of_b), highest = greater(highest, of_a);
      above_a = greater(above_a, of_a), below_b = lesser(below_b, of_b);
    }
    prism.lower = lowest - state_.extent, prism.upper = highest + state_.extent;
    prism.above_a = above_a, prism.below_b = below_b;
  }
  team_.sync();
}

/// The highest corner of a's triangles of the curve, and the lowest of b's; of several the vertex of the
/// least number.
template <typename Team>
TANDEM_HD void ManifoldMaker<Team>::find_extreme_corners(std::uint32_t curve, DepthMemory& shared) {
  const PatchFrame& frame = state_.frame;
  const std::uint32_t begin = memory_.start[curve], end = memory_.start[curve + 1];
  if constexpr (HasLanes<Team>) {
    for (int side = 0; side < 2; ++side)
      shared.extreme[2 + side] =
          team_.lanes().extreme_corner(bodies_[side], memory_, begin, end, frame, side);
    return;
  }
  Extreme best[2];
  for (std::uint32_t i = begin + team_.rank(); i < end; i += team_.size()) {
    for (int side = 0; side < 2; ++side) {
      const std::uint32_t t = memory_.pieces[memory_.order[i]].triangle[side];
      for (int k = 0; k < 3; ++k) {
        const Vector3 x = bodies_[side].corner(t, k);
        const Extreme here = {frame.flat(x), frame.height(x), bodies_[side].shape->topology[t].vertex[k]};
        if (ExtremeQuestions::is_further(static_cast<std::uint32_t>(side), here, best[side]))
          best[side] = here;
      }
    }
  }
  double along[2], furthest[2];
  for (int side = 0; side < 2; ++side) {
    along[side] = !best[side].found() ? -INFINITY : side == 0 ? best[side].height : -best[side].height;
    furthest[side] = along[side];
  }
  team_.greatest_ones(furthest);
  std::uint32_t vertex[2];
  for (int side = 0; side < 2; ++side)
    vertex[side] = along[side] == furthest[side] ? best[side].vertex : kNoIndex;
  team_.least_ones(vertex);
  // A vertex is posed to the same bits from each of its triangles.
  double at[4];
  for (int side = 0; side < 2; ++side) {
    const bool mine = best[side].vertex == vertex[side];
    at[2 * side] = mine ? best[side].at.x : -INFINITY, at[2 * side + 1] = mine ? best[side].at.y : -INFINITY;
  }
  team_.greatest_ones(at);
  if (team_.rank() == 0) {
    shared.extreme[2] = {{at[0], at[1]}, furthest[0], vertex[0]};
    shared.extreme[3] = {{at[2], at[3]}, -furthest[1], vertex[1]};
  }
}

/// A sounding where a body's vertex is; one that meets nothing, if there is no vertex.
template <typename Team>
TANDEM_HD void ManifoldMaker<Team>::place_vertex(int at, int side, const Extreme& vertex,
                                                 double height_of_middle) {
  Sounding& s = state_.sounding[at];
  s = {};
  s.reference = kNoIndex;
  if (!vertex.found()) return;
  s.at = s.line = vertex.at;
  s.height = vertex.height;
  s.target[side] = vertex.height;
  s.target[1 - side] = height_of_middle;
  s.vertex_of = side;
  s.feature = feature_hash(vertex.vertex, side == 0 ? 5 : 6);
}

/// Sounds the rim and the middle, and where triangles that the curve cuts are few, their highest corner of a
/// and their lowest of b: the tip of a coarse mesh may lean out of its rim. Before those come two soundings
/// for vertices within the rim.
template <typename Team>
TANDEM_HD void ManifoldMaker<Team>::sound_rim(bool few, std::uint32_t curve, DepthMemory& shared) {
  if (few) find_extreme_corners(curve, shared);
  team_.sync();
  const int inner = state_.rim_points + 1, end = inner + 4;
  const double height_of_middle = state_.sounding[state_.rim_points].height;
  for (int i = static_cast<int>(team_.rank()); i < 4; i += static_cast<int>(team_.size()))
    place_vertex(inner + i, i % 2, few && i >= 2 ? shared.extreme[i] : Extreme{}, height_of_middle);
  if (team_.rank() == 0) state_.soundings = end;
  team_.sync();
  const std::uint32_t corners = few ? 3u << (inner + 2) : 0u;
  sound(0, few ? end : inner, ((1u << inner) - 1) | corners, shared);
}

/// Sounds where a's highest vertex within the rim is, and b's lowest: there, or in the middle, the overlap is
/// deepest, or nearly. Where that is a corner that was sounded with the rim, it takes its place.
template <typename Team>
TANDEM_HD void ManifoldMaker<Team>::sound_deepest(bool few, DepthMemory& shared) {
  place_prism(shared);
  if constexpr (HasLanes<Team>) {
    for (int side = 0; side < 2; ++side)
      shared.extreme[side] = team_.lanes().find_extreme(bodies_[side], shared.prism, side);
  } else {
    ExtremeQuestions questions(bodies_, shared.prism, shared.prism_test, shared.extreme);
    for (std::uint32_t side = team_.rank(); side < 2; side += team_.size()) questions.ask(side);
    team_.sync();
    team_.template for_each_group<Team::kHalf>(2, [&](const auto& group, std::uint32_t side, bool given) {
      walk_surface(group, questions, side, given);
    });
  }
  team_.sync();
  const int inner = state_.rim_points + 1;
  const double height_of_middle = state_.sounding[state_.rim_points].height;
  std::uint32_t further = 0;
  for (int side = 0; side < 2; ++side) {
    const Extreme& vertex = shared.extreme[side];
    if (!vertex.found()) continue;
    const bool sounded = few && vertex.vertex == shared.extreme[2 + side].vertex;
    if (!sounded) further |= 1u << (inner + side);
    if (team_.rank() != static_cast<std::uint32_t>(side) % team_.size()) continue;
    if (sounded) {
      state_.sounding[inner + side] = state_.sounding[inner + 2 + side];
      place_vertex(inner + 2 + side, side, {}, 0);
    } else {
      place_vertex(inner + side, side, vertex, height_of_middle);
    }
  }
  team_.sync();
  if (further != 0) sound(inner, inner + 2, further, shared);
}

/// Looks whether lines that seem to overlap run within both bodies: where there are several curves, one may
/// bound a hole, or one body may go through the other; and where the overlap is large beside the rim, the
/// surfaces that the line found may not belong to the patch. A vertex is part of its own body, which the line
/// may touch there alone: that counts only where the vertex is not within the other body, and so its own may
/// end before the other begins, as where links of a chain hang in each other. Where there is one curve,
/// nothing goes through: then such a vertex is no part of the overlap, as the corner of a triangle that
/// reaches far beyond the patch.
template <typename Team>
TANDEM_HD void ManifoldMaker<Team>::look_behind(DepthMemory& shared) {
  const bool several = summary_.curves > 1;
  LineQuestions questions(bodies_, state_.frame, shared.line);
  const auto count = 2 * static_cast<std::uint32_t>(state_.soundings);
  bool any = false;
  for (std::uint32_t i = team_.rank(); i < count; i += team_.size()) {
    Sounding& s = state_.sounding[i / 2];
    const int side = static_cast<int>(i % 2);
    const bool wanted = s.overlap() > (several ? 0 : state_.extent / 2);
    if (wanted && side == 0) s.looked_behind = true;
    shared.line[i].side = -1;
    if (!wanted) continue;
    questions.ask(i, side, side == 0 ? -1 : 1, s.line, s.surface[side].height, s.surface[1].height,
                  s.surface[0].height, INFINITY);
    any = true;
  }
  if (!team_.any(any)) return;
  walk_lines(questions, count, shared);
  for (std::uint32_t i = team_.rank(); i < count; i += team_.size()) {
    if (shared.line[i].side < 0) continue;
    Sounding& s = state_.sounding[i / 2];
    const bool of_vertex = s.vertex_of >= 0, own_vertex = static_cast<int>(i % 2) == s.vertex_of;
    if (of_vertex && !own_vertex && !several && shared.line[i].best.found())
      s.surface[i % 2] = {};
    else if (!own_vertex || shared.line[i ^ 1u].best.found())
      s.behind[i % 2] = shared.line[i].best;
  }
  team_.sync();
}

/// Keeps what may become points: all that was sounded, with its depth.
template <typename Team>
TANDEM_HD void ManifoldMaker<Team>::place_candidates(const RimFinder<Team>& finder, bool touch,
                                                     ChoiceMemory& shared) {
  const int rank = static_cast<int>(team_.rank()), size = static_cast<int>(team_.size());
  for (int i = rank; i < state_.soundings; i += size) {
    const Sounding& s = state_.sounding[i];
    Chosen& c = shared.candidate[i];
    c.at = s.at;
    c.depth = !touch && s.within() ? s.overlap() : 0;
    c.height = c.depth > 0 ? (s.surface[0].height + s.surface[1].height) / 2 : s.height;
    c.from_middle = norm(s.at - state_.middle);
    c.inner = s.reference == kNoIndex;
    c.feature = s.feature;
    if (c.inner) {
      c.triangle[0] = s.surface[0].triangle, c.triangle[1] = s.surface[1].triangle;
    } else {
      const Piece& piece = finder.piece(s.reference);
      c.triangle[0] = piece.triangle[0], c.triangle[1] = piece.triangle[1];
    }
  }
  team_.sync();
}

/// The deepest inner point where it lies much deeper than the rim; else -1. Where it lies little deeper, the
/// rim's point nearest to it gets its depth: else depths would jump where a pose hardly changes, but its rim
/// gets other points.
template <typename Team>
TANDEM_HD int ManifoldMaker<Team>::much_deeper_inner_point(int most_of_rim, ChoiceMemory& shared) const {
  int inner = -1, nearest = -1;
  double deepest_of_rim = 0, of_inner = 0;
  for (int i = 0; i < state_.soundings; ++i) {
    const Chosen& c = shared.candidate[i];
    if (c.inner && c.depth > of_inner) of_inner = c.depth, inner = i;
    if (is_of_rim(i, most_of_rim, shared)) deepest_of_rim = greater(deepest_of_rim, c.depth);
  }
  if (inner < 0 || of_inner > kDeeper * deepest_of_rim) return inner;
  const double near = kNear * bodies_.smaller_diagonal();
  double least = near * near;
  for (int i = 0; i < state_.soundings; ++i) {
    const Vector2 apart = shared.candidate[i].at - shared.candidate[inner].at;
    if (is_of_rim(i, most_of_rim, shared) && dot(apart, apart) < least)
      least = dot(apart, apart), nearest = i;
  }
  if (nearest >= 0) {
    double& depth = shared.candidate[nearest].depth;
    if (of_inner > kLittleDeeper * depth && of_inner <= kSomewhatDeeper * depth) depth = of_inner;
  }
  return -1;
}

/// Chooses the first points of the rim, and an inner one unless `inner` is -1. Deeper points come first, then
/// those further out; of points near each other the first stays.
template <typename Team>
TANDEM_HD void ManifoldMaker<Team>::keep_apart(int most_of_rim, int inner, ChoiceMemory& shared) const {
  int order[kMostSoundings], count = 0, kept = 0;
  const auto before = [&](int i, int j) {
    const Chosen &x = shared.candidate[i], &y = shared.candidate[j];
    return x.depth > y.depth || (x.depth == y.depth && x.from_middle > y.from_middle);
  };
  for (int i = 0; i < state_.soundings; ++i) {
    if (!is_of_rim(i, most_of_rim, shared) && i != inner) continue;
    int j = count++;  // an insertion that is stable
    for (; j > 0 && before(i, order[j - 1]); --j) order[j] = order[j - 1];
    order[j] = i;
  }
  const double near = kNear * bodies_.smaller_diagonal();
  for (int i = 0; i < count; ++i) {
    const Chosen& c = shared.candidate[order[i]];
    bool alone = true;
    for (int k = 0; k < kept && alone; ++k) {
      const Vector2 apart = shared.chosen[k].at - c.at;
      alone = dot(apart, apart) >= near * near;
    }
    if (alone) shared.chosen[kept++] = c;
  }
  shared.count = static_cast<std::uint32_t>(kept);
}

/// Chooses the points of a manifold: the first of the rim as it is sounded, and an inner one that lies much
/// deeper.
template <typename Team>
TANDEM_HD void ManifoldMaker<Team>::choose(const RimFinder<Team>& finder, int most_of_rim, bool touch,
                                           ChoiceMemory& shared) {
  place_candidates(finder, touch, shared);
  if (team_.rank() == 0) keep_apart(most_of_rim, much_deeper_inner_point(most_of_rim, shared), shared);
  team_.sync();
}

template <typename Team>
TANDEM_HD void ManifoldMaker<Team>::write_points(const ChoiceMemory& shared, Patch& patch, int count) const {
  const PatchFrame& frame = state_.frame;
  const auto write = [](const Vector3& x, double(&out)[3]) { out[0] = x.x, out[1] = x.y, out[2] = x.z; };
  for (int i = static_cast<int>(team_.rank()); i < count; i += static_cast<int>(team_.size())) {
    const Chosen& c = shared.chosen[i];
    ManifoldPoint& point = patch.point[i];
    const Vector3 x = frame.at(c.at, c.height), half = (c.depth / 2) * frame.n;
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
}

template <typename Team>
TANDEM_HD void ManifoldMaker<Team>::write_manifold(const ChoiceMemory& shared, Patch& patch, int count,
                                                   bool hole, bool goes_through) const {
  const PatchFrame& frame = state_.frame;
  double deepest = 0, height = 0;
  for (int i = 0; i < count; ++i) height += shared.chosen[i].height / count;
  for (int i = 0; i < state_.soundings && !state_.touch && !hole; ++i) {
    const Sounding& s = state_.sounding[i];
    if (s.within()) deepest = greater(deepest, s.overlap());
  }
  const Vector2 centre = state_.closed && !state_.touch ? state_.middle_of_area : state_.middle;
  Vector3 area = state_.area;
  if (!state_.closed) {
    // The curve bounds no area: that of the rim stands in.
    double twice = 0;
    for (int i = 1; i + 1 < state_.rim_points; ++i) {
      const Vector2 p = state_.sounding[0].at;
      twice += cross(state_.sounding[i].at - p, state_.sounding[i + 1].at - p);
    }
    area = (std::fabs(twice) / 2) * frame.n;
  }
  if (state_.touch) area = {};
  const auto write = [](const Vector3& x, double(&out)[3]) { out[0] = x.x, out[1] = x.y, out[2] = x.z; };
  Manifold& manifold = patch.manifold;
  manifold = {};
  write(frame.n, manifold.normal);
  write(area, manifold.area_vector);
  write(frame.at(centre, height), manifold.centre);
  manifold.depth = deepest;
  manifold.point_count = static_cast<std::uint32_t>(count);
  manifold.flags = (state_.touch ? kTouching : 0u) | (state_.closed ? 0u : kOpenCurve) |
                   (goes_through ? kGoesThrough : 0u);
  patch.key = state_.key;
  patch.hole = hole ? 1 : 0;
}

template <typename Team>
TANDEM_HD bool ManifoldMaker<Team>::begin(std::uint32_t curve, OutlineMemory& shared) {
  team_.sync();  // all are done with what the last curve left
  NormalFinder<Team> normal_finder(team_, bodies_, memory_, summary_, curve, shared.normal);
  const CurveMeasure measure = normal_finder.measure();
  const PatchNormal normal = normal_finder.find(measure);
  if (!normal.known) return false;
  if (team_.rank() == 0) {
    state_.touch = normal.touch;
    state_.closed = measure.closed || (normal.touch && measure.point);
    state_.frame = PatchFrame(summary_.origin, normal.n);
    state_.area = measure.area;
    state_.key = measure.key;
  }
  team_.sync();
  RimFinder<Team> rim_finder(team_, bodies_, memory_, summary_, curve, state_.frame);
  rim_finder.gather(measure.closed && !summary_.degenerate, shared.next);
  // One point is left for an inner one.
  const int most_of_rim = kMostManifoldPoints - (normal.touch ? 0 : 1);
  rim_finder.find(most_of_rim, state_.frame.flat(measure.middle), shared.rim);
  if (shared.rim.rim.points == 0) return false;
  place_soundings(rim_finder, shared.rim.rim);
  return true;
}

template <typename Team>
TANDEM_HD void ManifoldMaker<Team>::measure_depths(std::uint32_t curve, DepthMemory& shared) {
  if (state_.touch) return;
  const bool few = memory_.start[curve + 1] - memory_.start[curve] <= kFewPieces;
  sound_rim(few, curve, shared);
  sound_deepest(few, shared);
  look_behind(shared);
}

template <typename Team>
template <typename NewPatch>
TANDEM_HD void ManifoldMaker<Team>::finish(std::uint32_t curve, int most_points, ChoiceMemory& shared,
                                           const NewPatch& new_patch) {
  bool goes_through = false, hole = false;
  if (!state_.touch && summary_.curves > 1 && state_.closed) {
    double deepest = 0;
    // No line is within the bodies, nor so short that rounding hides it.
    hole = true;
    const double rounding = 0x1p-40 * bodies_.reach();
    for (int i = 0; i <= state_.rim_points; ++i) {
      const Sounding& s = state_.sounding[i];
      const bool seen = s.surface[0].found() && s.surface[1].found();
      hole = hole && !s.within() && !(seen && std::fabs(s.overlap()) <= rounding);
      if (!s.within() || s.overlap() <= deepest) continue;
      deepest = s.overlap();
      goes_through = s.goes_through();
    }
    // The way back is the shorter one on the side where the middles are.
    if (goes_through && dot(state_.area, bodies_.apart()) < 0) return;
  }
  const RimFinder<Team> rim_finder(team_, bodies_, memory_, summary_, curve, state_.frame, state_.candidates);
  // The kind of the patch does not depend on how many points it may have.
  choose(rim_finder, state_.touch || most_points == 1 ? most_points : most_points - 1, state_.touch || hole,
         shared);
  const int found = static_cast<int>(shared.count), count = found < most_points ? found : most_points;
  rim_finder.name_points(shared.chosen, count, kNear / 2 * bodies_.smaller_diagonal(), state_.key);
  if (team_.rank() == 0) shared.patch = new_patch();
  team_.sync();
  Patch* const patch = shared.patch;
  if (patch == nullptr) return;
  write_points(shared, *patch, count);
  if (team_.rank() == 0) write_manifold(shared, *patch, count, hole, goes_through);
}

}  // namespace tandem::manifold
