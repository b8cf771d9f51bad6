#pragma once
#include "kernels/manifold/patch_normal.h"
#include "kernels/manifold/patch_ridges.h"
#include "kernels/manifold/patch_rim.h"
#include "kernels/manifold/patch_sheets.h"
#include "kernels/manifold/seed_finder.h"

/// The rule by which contacts become manifolds (docs/manifold_method.md), for CPU and GPU alike.
namespace tandem::manifold {

/// A line that sounds the depth at the rim is moved inwards by this part of the way to the middle, so that it
/// does not run along a wall that made the rim.
inline constexpr double kInwards = 0.02;

/// Points of a manifold closer than this part of the smaller body's diagonal are one.
inline constexpr double kNear = 0.005;

/// A point of the rim closer to the deepest one than this part of the rim's reach is that one.
inline constexpr double kNearDeepest = 0.03;

/// A point of the rim is as deep as the deepest line if it is less deep by no more than this part; it may be
/// deeper by kDeepEnough.
inline constexpr double kAsDeep = 1e-6;

/// A rim of so few candidates is measured from two points.
inline constexpr std::uint32_t kFewCandidates = 32;

/// Makes the patch of a region whose pieces are known, step by step. A patch's state, and where it is to be
/// measured, are all that the steps hand on to each other.
template <typename Team>
class ManifoldMaker {
 public:
  TANDEM_HD ManifoldMaker(const Team& team, const BodyPair& bodies, const PieceMemory& memory,
                          const PieceSummary& summary, PatchState& state)
      : team_(team), bodies_(bodies), memory_(memory), summary_(summary), state_(state) {}

  /// Finds the normal, or the directions in which a patch of kind `deep` is to be measured.
  TANDEM_HD void begin(std::uint32_t region, OutlineMemory& shared, DepthSearch& search);

  /// Finds the rim of a patch that has a normal, and places beside which points of the overlap are looked
  /// for.
  TANDEM_HD void outline(std::uint32_t region, OutlineMemory& shared, DepthSearch& search);

  /// Finds the surfaces beside the points of the rim, and points of the overlap from which to look for the
  /// deepest line. Condition, here and below: the patch is an overlap, or deep.
  TANDEM_HD void sound(DepthSearch& search, SearchMemory& shared);

  /// Finds the deepest line along a direction. The search for it ends as soon as one is as deep as
  /// search.enough.
  TANDEM_HD OverlapLine line_along(const DepthSearch& search, int direction, const PatchOptions& options,
                                   SearchMemory& shared) const;

  /// Finds how deep the overlap is along a direction at least.
  TANDEM_HD double least_depth_along(const DepthSearch& search, int direction, SearchMemory& shared) const;

  /// Takes the deepest line of a patch that is not deep, and finds its ridges.
  TANDEM_HD void end_overlap(const OverlapLine& line, LineMemory& lines);

  /// Finds the direction in which the overlap of a deep patch is shallowest, the rim and depths. If the
  /// bodies do not overlap along any direction, the patch is a touch where its area says how it pushes, and
  /// ambiguous elsewhere.
  TANDEM_HD_CALLED void end_deep(std::uint32_t region, const DepthSearch& search, const DeepLines& found,
                                 OutlineMemory& shared, LineMemory& lines);

  /// Does what is to be done between begin() and finish(), along one direction after the other.
  TANDEM_HD void measure(std::uint32_t region, const PatchOptions& options, DepthSearch& search,
                         OutlineMemory& shared, SearchMemory& depths);

  /// Chooses points. new_patch(): where the patch is to lie, or null; called by one of the team.
  template <typename NewPatch>
  TANDEM_HD void finish(std::uint32_t region, const PatchOptions& options, ChoiceMemory& shared,
                        const NewPatch& new_patch);

 private:
  TANDEM_HD void take_normal(const CurveMeasure& measure, const PatchNormal& normal);
  TANDEM_HD void find_rim(std::uint32_t region, const CurveMeasure& measure, OutlineMemory& shared);
  TANDEM_HD void place_soundings(const RimFinder<Team>& finder, const Rim& rim);
  TANDEM_HD std::uint32_t ask_at_rim(LineMemory& lines) const;
  TANDEM_HD void take_rim(const LineMemory& lines);
  TANDEM_HD bool goes_through(const OverlapLine& line, const PatchFrame& frame, LineMemory& lines) const;
  TANDEM_HD void take_deepest(const OverlapLine& line, bool through);
  TANDEM_HD void place_candidates(const RimFinder<Team>& finder, ChoiceMemory& shared) const;
  TANDEM_HD void place_sheets(ChoiceMemory& shared) const;
  TANDEM_HD void keep_apart(int most_of_rim, ChoiceMemory& shared) const;
  TANDEM_HD void write_points(const ChoiceMemory& shared, Patch& patch, int count) const;
  TANDEM_HD void write_manifold(const ChoiceMemory& shared, Patch& patch, int count) const;

  const Team& team_;
  const BodyPair& bodies_;
  PieceMemory memory_;
  const PieceSummary& summary_;
  PatchState& state_;
};

/// The lines by which the rim is sounded.
template <typename Team>
TANDEM_HD void ManifoldMaker<Team>::place_soundings(const RimFinder<Team>& finder, const Rim& rim) {
  const PatchFrame& frame = state_.frame;
  Vector2 middle;
  double mean_height = 0, extent = 0, reach = 0;
  for (int i = 0; i < rim.points; ++i) {
    const Vector3 x = finder.position(rim.reference[i]);
    middle = middle + frame.flat(x);
    mean_height += frame.height(x);
  }
  middle = (1.0 / rim.points) * middle;
  mean_height /= rim.points;
  const Vector3 centre = frame.at(middle, mean_height);
  for (int i = 0; i < rim.points; ++i) {
    const Vector3 x = finder.position(rim.reference[i]);
    extent = greater(extent, norm(frame.flat(x) - middle));
    reach = greater(reach, norm(x - centre));
  }
  for (int i = static_cast<int>(team_.rank()); i < rim.points; i += static_cast<int>(team_.size())) {
    Sounding& s = state_.sounding[i];
    s = {};
    const Vector3 x = finder.position(rim.reference[i]);
    s.at = frame.flat(x);
    s.line = s.at + kInwards * (middle - s.at);
    s.height = frame.height(x);
    s.reference = rim.reference[i];
    s.rank = rim.rank[i];
    s.feature = finder.feature(rim.reference[i]);
  }
  if (team_.rank() == 0) {
    state_.rim_points = rim.points;
    state_.centre = centre;
    state_.middle = state_.middle_of_area = middle;
    state_.reach = reach;
    Vector2 of_area;
    if (finder.middle_of_area(of_area) && norm(of_area - middle) <= extent) state_.middle_of_area = of_area;
    state_.candidates = finder.count();
  }
  team_.sync();
}

template <typename Team>
TANDEM_HD void ManifoldMaker<Team>::take_normal(const CurveMeasure& measure, const PatchNormal& normal) {
  const bool touch = normal.kind == PatchKind::touch;
  if (team_.rank() == 0) {
    state_.kind = normal.kind;
    state_.has_area = !touch;
    state_.closed = measure.closed || (touch && measure.point);
    state_.goes_through = state_.bent = state_.through = false;
    state_.deepest = {};
    for (OverlapLine& ridge : state_.ridge) ridge = {};
    state_.rim_points = 0;
    state_.area = measure.area;
    state_.centre = measure.middle;
    state_.key = measure.key;
    if (touch || normal.kind == PatchKind::overlap) state_.frame = PatchFrame(summary_.origin, normal.n);
  }
  team_.sync();
}

/// Finds the rim of a patch that has a normal; without one it is ambiguous.
template <typename Team>
TANDEM_HD void ManifoldMaker<Team>::find_rim(std::uint32_t region, const CurveMeasure& measure,
                                             OutlineMemory& shared) {
  const int most = state_.kind == PatchKind::touch ? kMostRimPoints : kMostRimPoints - 1;
  RimFinder<Team> rim_finder(team_, bodies_, memory_, summary_, region, state_.frame);
  rim_finder.gather(measure.closed && !summary_.degenerate, shared.next);
  rim_finder.find(most, state_.frame.flat(measure.middle), shared.rim);
  if (shared.rim.rim.points > 0) return place_soundings(rim_finder, shared.rim.rim);
  team_.sync();
  if (team_.rank() == 0) state_.kind = PatchKind::ambiguous;
  team_.sync();
}

template <typename Team>
TANDEM_HD void ManifoldMaker<Team>::begin(std::uint32_t region, OutlineMemory& shared, DepthSearch& search) {
  team_.sync();  // all are done with what the last region left
  NormalFinder<Team> normal_finder(team_, bodies_, memory_, summary_, region, shared.normal);
  {
    const CurveMeasure measure = normal_finder.measure();
    if (team_.rank() == 0) search.measure = measure;
    take_normal(measure, normal_finder.find(measure));
  }
  const bool is_deep = state_.kind == PatchKind::deep;
  const double reach = is_deep ? normal_finder.reach_from(search.measure.middle) : 0;
  const int lines = is_deep ? normal_finder.gather_for_deep(search.measure, reach) : 1;
  if (team_.rank() == 0) {
    search.middle = search.measure.middle, search.reach = reach;
    search.both_ways = is_deep && shared.normal.both_ways;
    search.directions = search.both_ways ? 2 * lines : lines;
    search.enough = INFINITY;
    if (state_.kind == PatchKind::overlap) search.tried[0] = state_.frame.n;
    for (int i = 0; i < lines && is_deep; ++i) search.tried[i] = shared.normal.tried[i];
  }
  team_.sync();
}

template <typename Team>
TANDEM_HD void ManifoldMaker<Team>::outline(std::uint32_t region, OutlineMemory& shared,
                                            DepthSearch& search) {
  const bool is_deep = state_.kind == PatchKind::deep;
  if (state_.kind == PatchKind::touch || state_.kind == PatchKind::overlap)
    find_rim(region, search.measure, shared);
  if (team_.rank() == 0 && state_.kind == PatchKind::overlap)
    search.middle = state_.centre, search.reach = state_.reach;
  team_.sync();
  if (state_.kind != PatchKind::overlap && !is_deep) return;
  const int wanted = is_deep || state_.candidates > kFewCandidates ? kMostSeeds : kMostSeeds / 2;
  SeedFinder<Team>(team_, bodies_, memory_, summary_)
      .find_places(region, search.middle, search.reach, wanted, search.seeds);
}

template <typename Team>
TANDEM_HD void ManifoldMaker<Team>::sound(DepthSearch& search, SearchMemory& shared) {
  const bool has_rim = state_.kind == PatchKind::overlap;
  SeedFinder<Team>(team_, bodies_, memory_, summary_)
      .go_inside(search.seeds, search.middle, has_rim ? ask_at_rim(shared.lines) : 0, shared.lines);
  if (!has_rim) return;
  take_rim(shared.lines);
  SheetFinder<Team>(team_, bodies_, memory_, summary_, state_).find(search.seeds, shared.lines);
}

template <typename Team>
TANDEM_HD OverlapLine ManifoldMaker<Team>::line_along(const DepthSearch& search, int direction,
                                                      const PatchOptions& options,
                                                      SearchMemory& shared) const {
  const bool winds = search.measure.length > kWinds * search.reach;
  const double flat = winds ? 0 : options.quick_depths ? INFINITY : kLooksBeside * search.reach;
  DeepestLine<Team> line(team_, bodies_, memory_, summary_, shared);
  line.begin(search.seeds);
  line.find(PatchFrame(summary_.origin, search.along(direction)), search.middle, search.reach, flat,
            search.enough);
  return line.best();
}

template <typename Team>
TANDEM_HD double ManifoldMaker<Team>::least_depth_along(const DepthSearch& search, int direction,
                                                        SearchMemory& shared) const {
  DeepestLine<Team> line(team_, bodies_, memory_, summary_, shared);
  line.begin(search.seeds);
  line.begin_with_seeds(PatchFrame(summary_.origin, search.along(direction)), search.reach);
  const OverlapLine best = line.best();
  return best.found() ? best.depth() : INFINITY;
}

template <typename Team>
TANDEM_HD_CALLED void ManifoldMaker<Team>::end_deep(std::uint32_t region, const DepthSearch& search,
                                                    const DeepLines& found, OutlineMemory& shared,
                                                    LineMemory& lines) {
  double least = INFINITY;
  for (int i = 0; i < search.directions; ++i) {
    if (found.along[i].found()) least = lesser(found.along[i].depth(), least);
  }
  PatchNormal normal;
  OverlapLine deepest;
  for (int i = 0; i < search.directions && normal.kind != PatchKind::overlap; ++i) {
    if (!found.along[i].found() || !(found.along[i].depth() <= least * (1 + kShallower))) continue;
    normal.n = search.along(i), normal.kind = PatchKind::overlap;
    deepest = found.along[i];
  }
  // Surfaces that cut themselves may have no inside there; the area still says where the patch pushes.
  const Vector3 push = search.measure.push();
  if (normal.kind != PatchKind::overlap && dot(push, push) > 0) normal = {push, PatchKind::overlap};
  take_normal(search.measure, normal);
  if (state_.kind != PatchKind::overlap) return;
  find_rim(region, search.measure, shared);
  if (state_.kind != PatchKind::overlap) return;
  const std::uint32_t asked = ask_at_rim(lines);
  LineQuestions questions(bodies_, lines.line);
  team_.sync();
  walk_lines(team_, questions, asked);
  take_rim(lines);
  SheetFinder<Team>(team_, bodies_, memory_, summary_, state_).find(search.seeds, lines);
  const bool through = deepest.found() && goes_through(deepest, state_.frame, lines);
  if (team_.rank() == 0) state_.goes_through = through;
  take_deepest(deepest, through);
}

template <typename Team>
TANDEM_HD void ManifoldMaker<Team>::measure(std::uint32_t region, const PatchOptions& options,
                                            DepthSearch& search, OutlineMemory& shared,
                                            SearchMemory& depths) {
  outline(region, shared, search);
  if (state_.kind != PatchKind::overlap && state_.kind != PatchKind::deep) return;
  sound(search, depths);
  if (state_.kind == PatchKind::overlap)
    return end_overlap(line_along(search, 0, options, depths), depths.lines);
  DeepLines found;
  // The directions along which the first lines are shallowest come first; of others little more is looked at.
  double known[2 * kMostTried];
  for (int i = 0; i < search.directions; ++i) known[i] = least_depth_along(search, i, depths);
  for (;;) {
    int next = -1;
    for (int i = 0; i < search.directions; ++i) {
      if (known[i] >= 0 && known[i] < (next < 0 ? search.enough : known[next])) next = i;
    }
    if (next < 0) break;  // none of the others is shallower
    known[next] = -1;
    found.along[next] = line_along(search, next, options, depths);
    search.enough = lesser(search.enough, enough_for_others(found.along[next]));
  }
  end_deep(region, search, found, shared, depths.lines);
}

/// Asks for the surfaces beside each point of the rim. Result: how many questions these are, the first ones.
template <typename Team>
TANDEM_HD std::uint32_t ManifoldMaker<Team>::ask_at_rim(LineMemory& lines) const {
  LineQuestions questions(bodies_, lines.line);
  const auto count = 2 * static_cast<std::uint32_t>(state_.rim_points);
  team_.sync();
  for (std::uint32_t i = team_.rank(); i < count; i += team_.size()) {
    const Sounding& s = state_.sounding[i / 2];
    const int side = static_cast<int>(i % 2);
    questions.ask(i, state_.frame, side, side == 0 ? 1 : -1, s.line, s.height, -INFINITY, INFINITY,
                  state_.reach / 4, kWall);
  }
  return count;
}

template <typename Team>
TANDEM_HD void ManifoldMaker<Team>::take_rim(const LineMemory& lines) {
  const auto count = 2 * static_cast<std::uint32_t>(state_.rim_points);
  for (std::uint32_t i = team_.rank(); i < count; i += team_.size())
    state_.sounding[i / 2].surface[i % 2] = lines.line[i].best;
  team_.sync();
}

template <typename Team>
TANDEM_HD void ManifoldMaker<Team>::end_overlap(const OverlapLine& line, LineMemory& lines) {
  const bool may_go_through = state_.bent && line.found();
  team_.sync();  // all have read that, and are done with the lines of the search
  take_deepest(line, may_go_through && goes_through(line, state_.frame, lines));
  RidgeFinder<Team>(team_, bodies_, state_).find(lines);
}

/// Returns whether one body ends within the other on a line. frame: what all of the team see.
template <typename Team>
TANDEM_HD bool ManifoldMaker<Team>::goes_through(const OverlapLine& line, const PatchFrame& frame,
                                                 LineMemory& lines) const {
  const double tolerance = bodies_.tolerance();
  LineQuestions questions(bodies_, lines.line);
  for (std::uint32_t side = team_.rank(); side < 2; side += team_.size()) {
    const double from = line.height[side];
    questions.ask(side, frame, static_cast<int>(side), side == 0 ? -1 : 1, line.at, from,
                  side == 0 ? -INFINITY : from + tolerance, side == 0 ? from - tolerance : INFINITY, INFINITY,
                  kGrazes);
  }
  team_.sync();
  walk_lines(team_, questions, 2);
  const Crossing &begin_a = lines.line[0].best, &end_b = lines.line[1].best;
  const bool goes = (begin_a.found() && begin_a.height > line.height[1]) ||
                    (end_b.found() && end_b.height < line.height[0]);
  team_.sync();  // all have read the answers
  return goes;
}

/// What is no deeper than rounding is a touch. through: of a bent patch, the line leaves the overlap on its
/// way.
template <typename Team>
TANDEM_HD void ManifoldMaker<Team>::take_deepest(const OverlapLine& line, bool through) {
  if (team_.rank() == 0) {
    if (line.found() && line.depth() > kNoArea * bodies_.reach())
      state_.deepest = line, state_.through = through;
    else
      state_.kind = PatchKind::touch, state_.goes_through = false;
    state_.bent = state_.bent && state_.deepest.found();
  }
  team_.sync();
}

/// What may become points: those of the rim, and the one of the deepest line. A point lies on the line along
/// which its depth is measured, so that it is on both surfaces.
template <typename Team>
TANDEM_HD void ManifoldMaker<Team>::place_candidates(const RimFinder<Team>& finder,
                                                     ChoiceMemory& shared) const {
  const int rank = static_cast<int>(team_.rank()), size = static_cast<int>(team_.size());
  const double deepest = state_.deepest.depth();
  for (int i = rank; i <= state_.rim_points + state_.ridges(); i += size) {
    Chosen& c = shared.candidate[i];
    if (i >= state_.rim_points) {
      const int next = i - state_.rim_points;  // 0 is the deepest line
      const OverlapLine& line = next == 0 ? state_.deepest : state_.ridge[next - 1];
      if (!line.found()) continue;
      c.at = line.at, c.depth = line.depth(), c.height = (line.height[0] + line.height[1]) / 2;
      c.triangle[0] = line.triangle[0], c.triangle[1] = line.triangle[1];
      c.feature = next == 0 ? feature_hash(0, 4) : feature_hash(state_.sounding[next - 1].feature, 6);
      c.deepest = next == 0;
    } else {
      const Sounding& s = state_.sounding[i];
      const Piece& piece = finder.piece(s.reference);
      c.at = s.at, c.height = s.height, c.depth = 0;
      c.triangle[0] = piece.triangle[0], c.triangle[1] = piece.triangle[1];
      c.feature = s.feature;
      c.deepest = false;
      // Other surfaces than those of the patch may be nearer to the rim; none of the patch is deeper.
      if (s.overlap() > 0 && s.overlap() <= deepest * (1 + kDeepEnough)) {
        double height[2];
        const Vector2 at = reach_to_rim(bodies_, state_.frame, s, height);
        if (height[0] - height[1] > kNoArea * bodies_.reach()) {
          c.at = at;
          c.depth = height[0] - height[1], c.height = (height[0] + height[1]) / 2;
        }
      }
    }
    c.normal = state_.frame.n;
    c.from_middle = norm(c.at - state_.middle);
  }
  team_.sync();
}

/// The points of a bent patch lie between its surfaces, and have their normals. The deepest line does if it
/// does not leave the overlap; a wall at which it lies has none.
template <typename Team>
TANDEM_HD void ManifoldMaker<Team>::place_sheets(ChoiceMemory& shared) const {
  int count = 0;
  const auto add = [&](const Sheet& sheet, Chosen& c) {
    c.at = state_.frame.flat(sheet.at), c.height = state_.frame.height(sheet.at);
    c.depth = sheet.depth, c.normal = sheet.normal, c.half = sheet.half;
    c.triangle[0] = sheet.triangle[0], c.triangle[1] = sheet.triangle[1];
    c.from_middle = norm(c.at - state_.middle);
    shared.candidate[count++] = c;
  };
  for (int i = 0; i < state_.rim_points; ++i) {
    if (state_.sheet[i].found) add(state_.sheet[i], shared.candidate[i]);
  }
  Chosen c = shared.candidate[state_.rim_points];
  Sheet sheet;
  if (!state_.through && state_.deepest.depth() <= kSheet * state_.reach &&
      find_sheet(bodies_, state_.deepest.triangle, sheet) > 0) {
    sheet.at = state_.frame.at(c.at, c.height);
    sheet.depth = c.depth * dot(sheet.normal, state_.frame.n);
    sheet.half = (c.depth / 2) * state_.frame.n;
    add(sheet, c);
  }
  for (int i = state_.rim_points; i < state_.sheets; ++i) {
    c.feature = feature_hash(static_cast<std::uint64_t>(i - state_.rim_points + 1), 4);
    c.deepest = true;
    if (state_.sheet[i].found) add(state_.sheet[i], c);
  }
  shared.count = static_cast<std::uint32_t>(count);
}

/// Chooses the deepest point, unless one of the rim is as deep, and the first of the rim. Deeper ones come
/// first, then those further out; of points near each other the first stays. The deepest point takes the name
/// of one of the rim near it.
template <typename Team>
TANDEM_HD void ManifoldMaker<Team>::keep_apart(int most_of_rim, ChoiceMemory& shared) const {
  int order[kMostCandidates] = {}, count = 0, kept = 0;
  const double tied = kTied * greater(state_.deepest.depth(), state_.reach);
  const auto before = [&](int i, int j) {
    const Chosen &x = shared.candidate[i], &y = shared.candidate[j];
    const double deeper = x.depth - y.depth;
    return deeper > tied || (deeper >= -tied && x.from_middle - y.from_middle > tied);
  };
  const auto insert = [&](int i) {  // stable
    int j = count++;
    for (; j > 0 && before(i, order[j - 1]); --j) order[j] = order[j - 1];
    order[j] = i;
  };
  bool has_deepest = state_.deepest.found() && !state_.bent;
  if (state_.bent) {
    place_sheets(shared);
    for (int i = 0; i < static_cast<int>(shared.count); ++i) insert(i);
  } else {
    for (int i = 0; i < state_.rim_points; ++i) {
      if (state_.sounding[i].rank >= most_of_rim) continue;
      if (shared.candidate[i].depth >= state_.deepest.depth() * (1 - kAsDeep)) has_deepest = false;
      insert(i);
    }
    if (has_deepest) insert(state_.rim_points);
    for (int i = 0; i < state_.ridges(); ++i) {
      if (state_.ridge[i].found()) insert(state_.rim_points + 1 + i);
    }
  }
  const double near = kNear * bodies_.smaller_diagonal(),
               near_deepest = greater(near, kNearDeepest * state_.reach);
  for (int i = 0; i < count; ++i) {
    const Chosen& c = shared.candidate[order[i]];
    bool alone = true;
    for (int k = 0; k < kept && alone; ++k) {
      Chosen& other = shared.chosen[k];
      const Vector2 apart = other.at - c.at;
      const double along = state_.bent ? other.height - c.height : 0;
      const double reach = k == 0 && has_deepest ? near_deepest : near;
      alone = dot(apart, apart) + along * along >= reach * reach;
      if (!alone && other.deepest) other.feature = c.feature, other.deepest = false;
    }
    if (alone) shared.chosen[kept++] = c;
  }
  shared.count = static_cast<std::uint32_t>(kept);
}

template <typename Team>
TANDEM_HD void ManifoldMaker<Team>::write_points(const ChoiceMemory& shared, Patch& patch, int count) const {
  const PatchFrame& frame = state_.frame;
  const auto write = [](const Vector3& x, double(&out)[3]) { out[0] = x.x, out[1] = x.y, out[2] = x.z; };
  for (int i = static_cast<int>(team_.rank()); i < count; i += static_cast<int>(team_.size())) {
    const Chosen& c = shared.chosen[i];
    ManifoldPoint& point = patch.point[i];
    const Vector3 x = frame.at(c.at, c.height), half = state_.bent ? c.half : (c.depth / 2) * c.normal;
    write(x, point.position);
    write(bodies_.a.in_file_coordinates(x + half), point.in_a);
    write(bodies_.b.in_file_coordinates(x - half), point.in_b);
    write(c.normal, point.normal);
    point.depth = c.depth;
    point.id = c.feature;
    point.face_a = bodies_.a.shape->triangles[c.triangle[0]].source_face();
    point.face_b = bodies_.b.shape->triangles[c.triangle[1]].source_face();
    point.previous = kNoIndex;
    point.manifold = kNoIndex;
  }
}

template <typename Team>
TANDEM_HD void ManifoldMaker<Team>::write_manifold(const ChoiceMemory& shared, Patch& patch,
                                                   int count) const {
  const auto write = [](const Vector3& x, double(&out)[3]) { out[0] = x.x, out[1] = x.y, out[2] = x.z; };
  const bool touch = state_.kind != PatchKind::overlap;
  Manifold& manifold = patch.manifold;
  manifold = {};
  patch.key = state_.key;
  manifold.point_count = static_cast<std::uint32_t>(count);
  manifold.flags = (touch ? kTouching : 0u) | (state_.closed ? 0u : kOpenCurve) |
                   (state_.goes_through ? kGoesThrough : 0u);
  if (state_.kind == PatchKind::ambiguous) {
    manifold.flags |= kAmbiguous;
    return write(state_.centre, manifold.centre);
  }
  const PatchFrame& frame = state_.frame;
  double height = 0, depth = 0;
  for (int i = 0; i < count; ++i) {
    height += shared.chosen[i].height / count;
    depth = greater(shared.chosen[i].depth, depth);
  }
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
  if (!state_.has_area) area = {};
  write(frame.n, manifold.normal);
  write(area, manifold.area_vector);
  write(frame.at(state_.closed && state_.has_area ? state_.middle_of_area : state_.middle, height),
        manifold.centre);
  manifold.depth = touch ? 0 : depth;
}

template <typename Team>
template <typename NewPatch>
TANDEM_HD void ManifoldMaker<Team>::finish(std::uint32_t region, const PatchOptions& options,
                                           ChoiceMemory& shared, const NewPatch& new_patch) {
  int count = 0;
  if (state_.kind != PatchKind::ambiguous) {
    const RimFinder<Team> rim_finder(team_, bodies_, memory_, summary_, region, state_.frame,
                                     state_.candidates);
    place_candidates(rim_finder, shared);
    if (team_.rank() == 0) keep_apart(options.most_points - (state_.deepest.found() ? 1 : 0), shared);
    team_.sync();
    const int found = static_cast<int>(shared.count);
    count = found < options.most_points ? found : options.most_points;
    rim_finder.name_points(shared.chosen, count, kNear / 2 * bodies_.smaller_diagonal(), state_.key);
  }
  if (team_.rank() == 0) shared.patch = new_patch();
  team_.sync();
  Patch* const patch = shared.patch;
  if (patch == nullptr) return;
  write_points(shared, *patch, count);
  if (team_.rank() == 0) write_manifold(shared, *patch, count);
}

}  // namespace tandem::manifold
