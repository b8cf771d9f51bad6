#pragma once
#include "kernels/manifold/search_memory.h"

/// The search for the line along a patch's normal on which two bodies overlap most.
///
/// On a line along the normal n, let an interval of a end at height h_a, and an interval of b begin at height
/// h_b below that. While b moves along n, the two overlap at last when it has moved by h_a - h_b, the depth
/// of the line. A line counts if from then back to now the overlap goes on: that is shown by a point of the
/// overlap from which one straight line within a leads to a's end, and another within b leads to b's
/// beginning, since each line along n between them meets both. The depth of the deepest line that counts is
/// how far b is to be moved to end the overlap.
///
/// The search begins with lines through a few points of the overlap. Each triangle that a line meets says
/// where its body ends: in a convex one, all points lie behind it. The line on which such half-spaces leave
/// the bodies the most overlap is looked at next. If it counts and is as deep as they allow, then of convex
/// bodies no line is deeper; else what it meets adds half-spaces, and the search goes on. A body that goes
/// on beyond a half-space is not convex there: then that one is forgotten.
///
/// What the half-spaces prove of convex bodies may be wrong of others: where two planes meet in a valley, a
/// body lies beyond either. So then lines around the best one are looked at. If they refute a half-space, all
/// are forgotten, and the search goes on in a square around the best line with what the lines around it met,
/// nearer and nearer. So of other bodies too a deepest line is found, if not always the deepest one.
namespace tandem::manifold {

/// A line is the deepest if none is deeper by more than this part.
inline constexpr double kDeepEnough = 1e-6;

/// An overlap that is deeper than this part of the patch's reach is no flat one.
inline constexpr double kNotFlat = 0.1;

/// If the deepest line is deeper than this part of the patch's reach, and a body not convex, lines around it
/// are looked at, whatever the half-spaces prove.
inline constexpr double kLooksBeside = 0.15;

/// These lines lie on a ring whose radius is first kFirstRing times the patch's reach and becomes kNextRing
/// times as large, down to kLastRing times the reach, as soon as the depth grows by no more than the part
/// kRingGain. If the depth grows beyond kGrown times that reach, it is the reach from then on.
inline constexpr double kFirstRing = 0.5, kNextRing = 0.35, kLastRing = 0.03, kRingGain = 1e-3, kGrown = 1.5;

/// Between two rings the search looks at kStepsOfRing lines at most. It goes on from kMostRings rings at
/// most, since on a GPU everybody waits for the longest search; one of 2,077 searches in piles ends by that.
inline constexpr int kStepsOfRing = 6, kMostRings = 12;

/// A patch whose curve is longer than its reach by this factor winds, as a thread does: the curve around a
/// convex flat one is 2 pi times as long at most. It may have several places where it is deep, even if it is
/// flat, so lines around the deepest one are looked at too.
inline constexpr double kWinds = 8;

/// The search looks at no more lines than this, beside those through the first points.
inline constexpr int kMostSteps = 16;

/// A line that is looked at moves this part of the way to a point of the overlap, so that it does not run
/// along an edge. That costs no more than this part of its depth.
inline constexpr double kOffEdge = 1e-10;

/// Looks for the deepest line of the overlap that the pieces order[begin] to order[end - 1] bound.
template <typename Team>
class DeepestLine {
 public:
  TANDEM_HD DeepestLine(const Team& team, const BodyPair& bodies, const PieceMemory& memory,
                        const PieceSummary& summary, SearchMemory& shared)
      : team_(team), bodies_(bodies), memory_(memory), summary_(summary), shared_(shared) {}

  /// Takes points of the overlap; see SeedFinder. This comes before the functions below.
  TANDEM_HD void begin(const Seeds& seeds) {
    team_.sync();
    for (int i = static_cast<int>(team_.rank()); i < seeds.count; i += static_cast<int>(team_.size()))
      shared_.seeds.at[i] = seeds.at[i], shared_.seeds.beside[i] = seeds.beside[i];
    if (team_.rank() == 0) shared_.seeds.count = seeds.count;
    team_.sync();
  }

  /// Returns what was found.
  TANDEM_HD OverlapLine best() const {
    const OverlapLine best = shared_.best;
    team_.sync();  // all have read it
    return best;
  }

  /// Finds the deepest of the lines through the seeds.
  TANDEM_HD void begin_with_seeds(const PatchFrame& frame, double reach);

  /// Finds shared.best; none where the bodies do not overlap along the normal. middle, reach: a ball around
  /// the pieces. If there are several regions, the line goes through it. Lines around the deepest one are
  /// looked at if it is deeper than `flat`. The search ends as soon as a line is as deep as `enough`, which
  /// others may lower meanwhile.
  TANDEM_HD void find(const PatchFrame& frame, const Vector3& middle, double reach, double flat,
                      const double& enough);

 private:
  /// The lines that are looked at around the best one.
  struct Ring {
    double size = 0, radius = 0;  ///< radius: 0 before the first ring
    double depth = 0;             ///< of the best line when they were looked at
    int looks = 0;                ///< how often the search has gone on from here
  };

  TANDEM_HD void search(double reach, double flat, const double& enough);
  TANDEM_HD bool goes_on_elsewhere() const;
  TANDEM_HD void ask_beside(double radius);
  TANDEM_HD void take_seed_within();
  TANDEM_HD bool refutes_half_spaces() const;
  TANDEM_HD void begin_anew(double radius);
  TANDEM_HD bool look_beside(double reach, double flat, Ring& ring);
  TANDEM_HD void begin_half_spaces(const Vector3& middle, double reach);
  TANDEM_HD void learn(int side, const Crossing& surface, HalfSpace& out) const;
  /// Forgets half-spaces beyond which the bodies go on, up to these heights on a line.
  TANDEM_HD void go_beyond(const Vector2& at, const double (&height)[2]) {
    not_convex_ = shared_.spaces.drop_before(team_, at, height, rounding(), beyond_rounding()) || not_convex_;
  }
  /// Points are before a plane if they are so by more than this: lines are moved off edges by less.
  TANDEM_HD double rounding() const {
    return greater(16 * bodies_.tolerance(), 10 * kOffEdge * bodies_.smaller_diagonal());
  }
  /// Faces of float32 corners, which are not quite flat, go on beyond each other by less than this.
  TANDEM_HD double beyond_rounding() const { return kNearEnd * bodies_.smaller_diagonal(); }
  TANDEM_HD void propose(int seed);
  /// Looks how deep is enough. It is called by one of the team.
  TANDEM_HD void see(const double& enough) { shared_.enough = *static_cast<const volatile double*>(&enough); }
  TANDEM_HD bool is_deep_enough() const { return shared_.best.depth() >= shared_.enough; }
  TANDEM_HD void ask_along(const Vector2& at, const double (&from)[2], const double (&limit)[2],
                           double expected);
  TANDEM_HD void go_to_ends();
  TANDEM_HD OverlapLine line_that_counts(int from, bool& is_loose) const;
  TANDEM_HD bool learn_from_lines(int from);
  TANDEM_HD bool step(int from);
  TANDEM_HD void improve(int seed, int most_steps, bool is_proposed, const double& enough);

  const Team& team_;
  const BodyPair& bodies_;
  const PieceMemory& memory_;
  const PieceSummary& summary_;
  static constexpr int kLines = 4;           ///< of a step: along the proposed line, and straight to its ends
  static constexpr int kBeside = 8;          ///< lines around the best one
  static constexpr std::uint32_t kRing = 2;  ///< the first of their questions

  bool not_convex_ = false;  ///< a body goes on beyond a half-space
  SearchMemory& shared_;
};

template <typename Team>
TANDEM_HD void DeepestLine<Team>::begin_with_seeds(const PatchFrame& frame, double reach) {
  team_.sync();
  if (team_.rank() == 0) shared_.frame = frame;
  team_.sync();
  LineQuestion* const line = shared_.lines.line;
  LineQuestions questions(bodies_, line);
  const int count = shared_.seeds.count;
  for (int i = static_cast<int>(team_.rank()); i < 2 * count; i += static_cast<int>(team_.size())) {
    const int side = i % 2;
    const Vector3& point = shared_.seeds.at[i / 2];
    const double from = shared_.frame.height(point);
    questions.ask(static_cast<std::uint32_t>(i), shared_.frame, side, side == 0 ? 1 : -1,
                  shared_.frame.flat(point), from, side == 0 ? from : -INFINITY, side == 0 ? INFINITY : from,
                  reach, kGrazes);
  }
  team_.sync();
  walk_lines(team_, questions, 2 * static_cast<std::uint32_t>(count));
  if (team_.rank() == 0) {
    shared_.best = {};
    shared_.is_loose = false;
    TANDEM_ROLLED
    for (int i = 0; i < count; ++i) {
      const LineQuestion &top = line[2 * i], &bottom = line[2 * i + 1];
      if (!top.best.found() || !bottom.best.found()) continue;
      if (!(top.best.height - bottom.best.height > shared_.best.depth() * (1 + kTied))) continue;
      shared_.best = {
          {top.best.triangle, bottom.best.triangle}, top.at, {top.best.height, bottom.best.height}};
      shared_.from = i;
    }
  }
  team_.sync();
}

/// Returns whether some corners show that a body goes on beyond its half-spaces, and so is not convex.
template <typename Team>
TANDEM_HD bool DeepestLine<Team>::goes_on_elsewhere() const {
  constexpr std::uint32_t kCorners = 32;  // of each body
  bool goes_on = false;
  TANDEM_ROLLED
  for (std::uint32_t i = team_.rank(); i < 2 * kCorners; i += team_.size()) {
    const int side = static_cast<int>(i % 2);
    const Shape& shape = *bodies_[side].shape;
    const auto triangle = static_cast<std::uint32_t>(std::uint64_t{i / 2} * shape.triangle_count / kCorners);
    const Vector3 x = bodies_[side].corner(triangle, 0);
    goes_on = goes_on || shared_.spaces.any_before(side, shared_.frame.flat(x), shared_.frame.height(x),
                                                   kNearEnd * shape.diagonal);
  }
  return team_.any(goes_on);
}

/// Finds the half-space of a triangle that a line met; none if there is no triangle.
template <typename Team>
TANDEM_HD void DeepestLine<Team>::learn(int side, const Crossing& surface, HalfSpace& out) const {
  out.side = static_cast<std::uint16_t>(side);
  out.triangle = surface.triangle;
  out.normal = {}, out.offset = 0;
  if (!surface.found()) return;
  const WorldTriangle triangle = bodies_[side].triangle(surface.triangle);
  const PatchFrame& frame = shared_.frame;
  const Vector3& n = triangle.normal;
  out.normal = {dot(frame.u, n), dot(frame.v, n), dot(frame.n, n)};
  out.offset = dot(n, triangle.corner[0] - frame.origin);
}

template <typename Team>
TANDEM_HD void DeepestLine<Team>::propose(int seed) {
  LineOfTwo p = shared_.spaces.deepest(team_, 8 * bodies_.tolerance());
  p.found = p.found && p.depth() > shared_.best.depth() * (1 + kDeepEnough);
  const Vector3& from = shared_.seeds.at[seed];
  const double height = shared_.frame.height(from);
  p.at = p.at + kOffEdge * (shared_.frame.flat(from) - p.at);
  for (double& h : p.height) h += kOffEdge * (height - h);
  team_.sync();  // all have read what was proposed before
  if (team_.rank() == 0) shared_.proposed = p;
  team_.sync();
}

/// Begins with the triangles that the lines through the seeds met, and those of the pieces beside them.
template <typename Team>
TANDEM_HD void DeepestLine<Team>::begin_half_spaces(const Vector3& middle, double reach) {
  double far = 0;
  for (int side = 0; side < 2; ++side) {
    const Body& body = bodies_[side];
    far = greater(far, norm(body.centre - middle) + body.shape->diagonal);
  }
  const PatchFrame& frame = shared_.frame;
  if (team_.rank() == 0) {
    const Vector2 flat = frame.flat(middle);
    const double half = summary_.curves <= 1 ? far : reach;
    shared_.steps = 0;
    shared_.spaces.begin(flat, frame.flat(shared_.seeds.at[shared_.from]) - flat, half, frame.height(middle),
                         far);
  }
  static_assert(HalfSpaces::kFirst == 4 * kMostSeeds);
  const int count = 4 * shared_.seeds.count;
  TANDEM_ROLLED
  for (int i = static_cast<int>(team_.rank()); i < HalfSpaces::kMost; i += static_cast<int>(team_.size())) {
    HalfSpace& space = shared_.spaces.space[i];
    space = {};
    if (i >= count) continue;
    const int side = i % 2, seed = i / 4;
    const Crossing of_piece = {0, memory_.pieces[shared_.seeds.beside[seed]].triangle[side]};
    learn(side, i % 4 < 2 ? shared_.lines.line[2 * seed + side].best : of_piece, space);
  }
  team_.sync();
  TANDEM_ROLLED
  for (int i = 0; i < shared_.seeds.count; ++i) {
    const LineQuestion &top = shared_.lines.line[2 * i], &bottom = shared_.lines.line[2 * i + 1];
    if (top.best.found() && bottom.best.found()) go_beyond(top.at, {top.best.height, bottom.best.height});
  }
}

/// Asks where a ends and b begins on a line. from: heights from which on they are looked for; expected: how
/// far away they are, mostly.
template <typename Team>
TANDEM_HD void DeepestLine<Team>::ask_along(const Vector2& at, const double (&from)[2],
                                            const double (&limit)[2], double expected) {
  LineQuestions questions(bodies_, shared_.lines.line);
  for (std::uint32_t side = team_.rank(); side < 2; side += team_.size())
    questions.ask(side, shared_.frame, static_cast<int>(side), side == 0 ? 1 : -1, at, from[side],
                  side == 0 ? limit[0] : -INFINITY, side == 0 ? INFINITY : limit[1], expected, kGrazes);
}

/// Returns the line that counts of what was found along the proposed one, and along straight lines to its
/// ends; none where that is no deeper than the best. As far as both of those stay within their bodies, all
/// lines between them count.
template <typename Team>
TANDEM_HD OverlapLine DeepestLine<Team>::line_that_counts(int from, bool& is_loose) const {
  const LineQuestion* const line = shared_.lines.line;
  const LineOfTwo& p = shared_.proposed;
  const double within = kNearEnd * bodies_.smaller_diagonal() + 16 * bodies_.tolerance();
  double part = 1;
  int blocked = -1;
  for (int side = 0; side < 2; ++side) {
    const Crossing& surface = line[2 + side].best;
    if (surface.found() && surface.height < part * line[2 + side].length)
      part = surface.height / line[2 + side].length, blocked = side;
  }
  OverlapLine out;
  if (!(part * p.depth() > shared_.best.depth())) return out;
  if (blocked >= 0) {
    const Vector2 at = shared_.frame.flat(shared_.seeds.at[from]);
    const double height = shared_.frame.height(shared_.seeds.at[from]);
    out.at = at + part * (p.at - at);
    for (int side = 0; side < 2; ++side) out.height[side] = height + part * (p.height[side] - height);
    const std::uint32_t met = line[2 + blocked].best.triangle;
    const std::uint32_t other =
        shared_.spaces.nearest_triangle(team_, 1 - blocked, out.at, out.height[1 - blocked]);
    out.triangle[0] = blocked == 0 ? met : other, out.triangle[1] = blocked == 0 ? other : met;
    is_loose = true;
  } else {
    const bool on_wall = shared_.spaces.on_wall(p.at, within);
    out.at = p.at;
    TANDEM_ROLLED
    for (int side = 0; side < 2; ++side) {
      const Crossing& end = line[side].best;
      const double further = side == 0 ? end.height - p.height[0] : p.height[1] - end.height;
      // A body may go on beyond what the half-spaces say. A line along an edge may miss it.
      const bool found = end.found() && further > -within;
      out.height[side] = found ? end.height : p.height[side];
      out.triangle[side] = found ? end.triangle
                           : on_wall
                               ? kNoIndex
                               : shared_.spaces.nearest_triangle(team_, side, p.at, p.height[side], within);
    }
  }
  // What the search ends early for must not become less.
  return out.depth() > shared_.best.depth() ? out : OverlapLine();
}

/// Adds the half-spaces of what the lines met; false if all were known.
template <typename Team>
TANDEM_HD bool DeepestLine<Team>::learn_from_lines(int from) {
  const LineQuestion* const line = shared_.lines.line;
  for (int i = static_cast<int>(team_.rank()); i < kLines; i += static_cast<int>(team_.size()))
    learn(i % 2, line[i].best, shared_.learnt[i]);
  team_.sync();
  const Vector2 at = shared_.frame.flat(shared_.seeds.at[from]);
  const double height = shared_.frame.height(shared_.seeds.at[from]);
  unsigned is_new = 0;
  for (int i = 0; i < kLines; ++i) {
    const HalfSpace& space = shared_.learnt[i];
    is_new |= space.triangle != kNoIndex && space.beyond(at, height) < 0 ? 1u << i : 0u;
  }
  is_new &= ~shared_.spaces.known(team_, shared_.learnt);
  team_.sync();  // all have seen what is known
  for (int i = static_cast<int>(team_.rank()); i < kLines; i += static_cast<int>(team_.size())) {
    if ((is_new >> i & 1u) == 0) continue;
    HalfSpace& place = shared_.spaces.learnt(kLines * shared_.steps + i);
    place = shared_.learnt[i];
    place.counts = true;
  }
  team_.sync();
  return is_new != 0;
}

/// Looks at the line that is proposed. False if nothing came of it.
template <typename Team>
TANDEM_HD bool DeepestLine<Team>::step(int from) {
  const LineOfTwo& p = shared_.proposed;
  const OverlapLines<Team> lines(team_, bodies_, memory_, summary_, shared_.lines);
  LineQuestions questions(bodies_, shared_.lines.line);
  const double target = (p.height[0] + p.height[1]) / 2;
  team_.sync();
  ask_along(p.at, {target, target}, {-INFINITY, INFINITY}, p.depth());
  lines.ask_straight(2, shared_.seeds.at[from],
                     {shared_.frame.at(p.at, p.height[0]), shared_.frame.at(p.at, p.height[1])});
  team_.sync();
  walk_lines(team_, questions, kLines);
  bool is_loose = false;
  const OverlapLine next = line_that_counts(from, is_loose);
  if (next.found()) go_beyond(next.at, next.height);
  const bool learns = learn_from_lines(from);
  if (team_.rank() == 0) {
    if (next.found()) shared_.best = next, shared_.is_loose = is_loose, shared_.from = from;
    ++shared_.steps;
  }
  team_.sync();
  return next.found() || learns;
}

/// Follows the best line to where both bodies end, if that is not known yet.
template <typename Team>
TANDEM_HD void DeepestLine<Team>::go_to_ends() {
  if (!shared_.is_loose) return;
  const double(&height)[2] = shared_.best.height;
  const double rounding = 16 * bodies_.tolerance();
  team_.sync();
  ask_along(shared_.best.at, {height[0], height[1]}, {height[0] - rounding, height[1] + rounding},
            shared_.best.depth());
  team_.sync();
  LineQuestion* const line = shared_.lines.line;
  LineQuestions questions(bodies_, line);
  walk_lines(team_, questions, 2);
  if (team_.rank() == 0) {
    OverlapLine& best = shared_.best;
    for (int side = 0; side < 2; ++side) {
      const Crossing& end = line[side].best;
      if (!end.found()) continue;
      best.triangle[side] = end.triangle;
      best.height[side] =
          side == 0 ? greater(end.height, best.height[side]) : lesser(end.height, best.height[side]);
    }
  }
  team_.sync();
}

/// Looks at the lines that are proposed one after the other, as seen from a seed. is_proposed: the first one
/// is proposed already, whatever else there is to look at.
template <typename Team>
TANDEM_HD void DeepestLine<Team>::improve(int seed, int most_steps, bool is_proposed, const double& enough) {
  const Vector3& from = shared_.seeds.at[seed];
  bool looks_from_seed = false, goes_on = true;
  while (goes_on) {
    if (!is_proposed) {
      if (!looks_from_seed)
        shared_.spaces.look_from(team_, shared_.frame.flat(from), shared_.frame.height(from));
      looks_from_seed = true;
      propose(seed);
      if (team_.rank() == 0) see(enough);
      team_.sync();
      if (!shared_.proposed.found || shared_.steps >= most_steps || is_deep_enough()) return;
    }
    goes_on = step(seed) || is_proposed;
    is_proposed = false;
  }
}

/// Improves the best of the lines through the seeds, as seen from each of them; then goes on from lines
/// around the best one, as long as they refute what the half-spaces prove. All of it is one loop, so that a
/// GPU has its code once: instructions are what it waits for.
template <typename Team>
TANDEM_HD void DeepestLine<Team>::search(double reach, double flat, const double& enough) {
  const int deepest = shared_.from;
  int tried = 0;
  Ring ring;
  while (!is_deep_enough()) {
    const bool by_seeds = tried < shared_.seeds.count;
    int seed = tried == 0 ? deepest : tried <= deepest ? tried - 1 : tried;
    ++tried;
    if (by_seeds) {
      // Where faces of both bodies lie in each other, a seed may be no point within them.
      const Vector3& from = shared_.seeds.at[seed];
      if (shared_.spaces.in_plane(team_, shared_.frame.flat(from), shared_.frame.height(from), rounding()))
        continue;
    } else {
      if (!look_beside(reach, flat, ring)) return;
      seed = shared_.from;
    }
    improve(seed, by_seeds ? kMostSteps : kStepsOfRing, !by_seeds && shared_.proposed.found, enough);
  }
}

/// Asks for both surfaces on lines around the best one, above and below its middle, and whether the middle is
/// a point of the overlap: whether a straight line from the seed leads there.
template <typename Team>
TANDEM_HD void DeepestLine<Team>::ask_beside(double radius) {
  const OverlapLine& best = shared_.best;
  const Vector2 along = shared_.spaces.along();
  const double middle = (best.height[0] + best.height[1]) / 2;
  const Vector3 within = shared_.frame.at(best.at, middle);
  LineQuestions questions(bodies_, shared_.lines.line);
  team_.sync();  // all have read the answers before
  OverlapLines<Team>(team_, bodies_, memory_, summary_, shared_.lines)
      .ask_straight(0, shared_.seeds.at[shared_.from], {within, within});
  for (std::uint32_t i = team_.rank(); i < 2 * kBeside; i += team_.size()) {
    const std::uint32_t eighth = i / 2 % 4;  // of a turn; the other four lie opposite
    const double diagonal = eighth % 2 != 0 ? 0.7071067811865476 : 1;
    const double c = eighth == 2 ? 0 : diagonal, s = eighth == 0 ? 0 : eighth == 3 ? -diagonal : diagonal;
    const double r = (i / 2 < 4 ? 1 : -1) * (eighth % 2 != 0 ? radius / 2 : radius);
    const Vector2 at = best.at + r * Vector2{c * along.x - s * along.y, c * along.y + s * along.x};
    const bool of_a = i % 2 == 0;
    questions.ask(kRing + i, shared_.frame, of_a ? 0 : 1, of_a ? 1 : -1, at, middle,
                  of_a ? middle : -INFINITY, of_a ? INFINITY : middle, best.depth(), kGrazes);
  }
  team_.sync();
  walk_lines(team_, questions, kRing + 2 * kBeside);
}

/// If the middle of the best line is a point of the overlap, it becomes the seed: more lines are seen from
/// there.
template <typename Team>
TANDEM_HD void DeepestLine<Team>::take_seed_within() {
  const LineQuestion* const line = shared_.lines.line;
  if (team_.rank() == 0 && !line[0].best.found() && !line[1].best.found()) {
    const OverlapLine& best = shared_.best;
    shared_.seeds.at[shared_.from] = shared_.frame.at(best.at, (best.height[0] + best.height[1]) / 2);
  }
  team_.sync();
}

/// Returns whether a line around the best one is deeper, or a body goes on there beyond a half-space that
/// counts. The deepest of them is proposed if it is deeper.
template <typename Team>
TANDEM_HD bool DeepestLine<Team>::refutes_half_spaces() const {
  const LineQuestion* const line = shared_.lines.line + kRing;
  const auto overlaps = [&](int i) { return line[2 * i].best.found() && line[2 * i + 1].best.found(); };
  double depth = shared_.best.depth() * (1 + kDeepEnough);
  int deepest = -1;
  TANDEM_ROLLED
  for (int i = 0; i < kBeside; ++i) {
    if (!overlaps(i) || !(line[2 * i].best.height - line[2 * i + 1].best.height > depth)) continue;
    depth = (line[2 * i].best.height - line[2 * i + 1].best.height) * (1 + kTied), deepest = i;
  }
  bool goes_on = false;
  TANDEM_ROLLED
  for (int i = static_cast<int>(team_.rank()); i < 2 * kBeside; i += static_cast<int>(team_.size())) {
    goes_on = goes_on || (overlaps(i / 2) && shared_.spaces.any_that_counts_before(
                                                 i % 2, line[i].at, line[i].best.height, beyond_rounding()));
  }
  if (team_.rank() == 0) {
    shared_.proposed.found = deepest >= 0;
    if (deepest >= 0) {
      const LineQuestion &top = line[2 * deepest], &bottom = line[2 * deepest + 1];
      shared_.proposed = {top.at, {top.best.height, bottom.best.height}, true};
    }
  }
  const bool refutes = team_.any(goes_on) || deepest >= 0;
  team_.sync();  // all have read the half-spaces
  return refutes;
}

/// Begins anew, in a square around the best line, with the half-spaces of what that and the lines around it
/// met.
template <typename Team>
TANDEM_HD void DeepestLine<Team>::begin_anew(double radius) {
  const LineQuestion* const line = shared_.lines.line + kRing;
  if (team_.rank() == 0) {
    shared_.steps = 0;
    shared_.spaces.look_near(shared_.best.at, 1.5 * radius);
  }
  static_assert(2 * kBeside + 2 <= HalfSpaces::kMost);
  TANDEM_ROLLED
  for (int i = static_cast<int>(team_.rank()); i < HalfSpaces::kMost; i += static_cast<int>(team_.size())) {
    HalfSpace& space = shared_.spaces.space[i];
    Crossing met;
    if (i < 2 * kBeside) met = line[i].best;
    if (i / 2 == kBeside) met.triangle = shared_.best.triangle[i % 2];
    learn(i % 2, met, space);
    space.counts = false;
  }
  team_.sync();
  go_beyond(shared_.best.at, shared_.best.height);
  TANDEM_ROLLED
  for (int i = 0; i < kBeside; ++i) {
    const LineQuestion &top = line[2 * i], &bottom = line[2 * i + 1];
    if (top.best.found() && bottom.best.found()) go_beyond(top.at, {top.best.height, bottom.best.height});
  }
}

/// Looks at lines around the best one, if that is worth it, nearer and nearer until they refute what the
/// half-spaces prove; then the search begins anew there. False if none refutes it.
template <typename Team>
TANDEM_HD bool DeepestLine<Team>::look_beside(double reach, double flat, Ring& ring) {
  const double depth = shared_.best.depth();
  if (ring.radius == 0) {
    if (!(depth > flat) || !(not_convex_ || goes_on_elsewhere())) return false;
    ring.size = reach;
  }
  // A small curve may be where a large overlap ends.
  const double size = depth > kGrown * ring.size ? depth : ring.size;
  if (ring.radius == 0 || size > ring.size) {
    ring.size = size;
    ring.radius = kFirstRing * size;
  } else if (!(depth > ring.depth * (1 + kRingGain))) {
    ring.radius *= kNextRing;
  }
  ring.depth = depth;
  if (ring.looks++ == kMostRings) return false;
  for (; ring.radius > kLastRing * ring.size; ring.radius *= kNextRing) {
    ask_beside(ring.radius);
    take_seed_within();
    if (!refutes_half_spaces()) continue;
    begin_anew(ring.radius);
    return true;
  }
  return false;
}

template <typename Team>
TANDEM_HD void DeepestLine<Team>::find(const PatchFrame& frame, const Vector3& middle, double reach,
                                       double flat, const double& enough) {
  if (team_.rank() == 0) see(enough);
  begin_with_seeds(frame, reach);
  if (!shared_.best.found() || is_deep_enough()) return;
  begin_half_spaces(middle, reach);
  search(reach, flat, enough);
  go_to_ends();
}

}  // namespace tandem::manifold
