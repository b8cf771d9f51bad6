#pragma once
#include "kernels/manifold/patch.h"

/// A thin overlap of surfaces that fit each other and are bent, as of a nut on a bolt, has no one normal. It
/// is looked at across: lines along the surfaces' own normals say where these face each other.
namespace tandem::manifold {

/// Two surfaces face each other if the cosine of the angle between a's normal and the reverse of b's is more
/// than this.
inline constexpr double kFacing = 0.9;

/// A patch may be bent if, somewhere at its rim, the mean of both surfaces' normals leans from its own by
/// more than some 6 degrees (this is the square of the sine), and by more than twice the angle between them:
/// a ball in a bowl that it fits, not one on a floor or on another ball. Sheets that lean more than the
/// cosine below says, such as plates whose edges overlap, do not make it so.
inline constexpr double kBent = 0.01, kLeastBent = 0.2;

/// Surfaces bound a thin overlap if their distance is at most this part of the patch's reach.
inline constexpr double kSheet = 0.1;

/// A patch is bent only if it is thin beside so many points of its rim, and half of them, and at half of the
/// seeds: fewer points hold no body. And a body must not be convex.
inline constexpr int kFewestThin = 3;

/// Takes two triangles and their normal, if they face each other. Result: the cosine of the angle between a's
/// normal and the reverse of b's, or 0.
TANDEM_HD_CALLED inline double find_sheet(const BodyPair& bodies, const std::uint32_t (&triangle)[2],
                                          Sheet& out) {
  if (triangle[0] == kNoIndex || triangle[1] == kNoIndex) return 0;
  const Vector3 a = bodies.a.triangle(triangle[0]).normal, b = -bodies.b.triangle(triangle[1]).normal;
  if (!(dot(a, b) > kFacing)) return 0;
  out.normal = normalized(a + b);
  out.triangle[0] = triangle[0], out.triangle[1] = triangle[1];
  return dot(a, b);
}

/// Finds out whether a patch is bent, and what lies beside its points then: PatchState::sheet.
template <typename Team>
class SheetFinder {
 public:
  TANDEM_HD SheetFinder(const Team& team, const BodyPair& bodies, const PieceMemory& memory,
                        const PieceSummary& summary, PatchState& state)
      : team_(team), bodies_(bodies), memory_(memory), summary_(summary), state_(state) {}

  /// Condition: the rim has been sounded. seeds: points of the overlap.
  TANDEM_HD void find(const Seeds& seeds, LineMemory& lines) {
    if (leans_somewhere()) look_across(seeds, lines);
  }

 private:
  TANDEM_HD bool leans_somewhere() const;
  TANDEM_HD std::uint32_t go_beside_rim(LineMemory& lines) const;
  TANDEM_HD_CALLED void look_across(const Seeds& seeds, LineMemory& lines);
  TANDEM_HD void ask_across(int i, int round, const Vector3& from, std::uint32_t piece, bool is_inside,
                            LineMemory& lines) const;
  TANDEM_HD void take_across(const LineQuestion& top, const LineQuestion& bottom, Sheet& best) const;
  TANDEM_HD bool is_concave(int sheets) const;
  TANDEM_HD int rank() const { return static_cast<int>(team_.rank()); }
  TANDEM_HD int size() const { return static_cast<int>(team_.size()); }
  TANDEM_HD std::uint32_t piece_at_rim(int i) const { return state_.sounding[i].reference / 8; }

  const Team& team_;
  const BodyPair& bodies_;
  const PieceMemory& memory_;
  const PieceSummary& summary_;
  PatchState& state_;
};

template <typename Team>
TANDEM_HD bool SheetFinder<Team>::leans_somewhere() const {
  const Vector3& n = state_.frame.n;
  bool leans = false;
  for (int i = rank(); i < state_.rim_points; i += size()) {
    const Sounding& s = state_.sounding[i];
    const Piece& piece = memory_.pieces[piece_at_rim(i)];
    const bool sounded = s.surface[0].found() && s.surface[1].found();
    const std::uint32_t triangle[2] = {sounded ? s.surface[0].triangle : piece.triangle[0],
                                       sounded ? s.surface[1].triangle : piece.triangle[1]};
    // If a leans by less than three quarters of the least angle, the mean does not lean enough.
    const double of_a = dot(bodies_.a.triangle(triangle[0]).normal, n);
    if (1 - of_a * of_a < 0.5 * kBent) continue;
    Sheet sheet;
    const double cosine = find_sheet(bodies_, triangle, sheet);
    if (!(cosine > 0)) continue;
    const double along = dot(sheet.normal, n), lean = 1 - along * along, turn = 2 * (1 - cosine);
    leans = leans || (along > kLeastBent && lean > kBent && lean > 4 * turn);
  }
  return team_.any(leans);
}

/// Finds points of the overlap beside the rim: LineMemory::inside, and a bit of the result for each.
template <typename Team>
TANDEM_HD std::uint32_t SheetFinder<Team>::go_beside_rim(LineMemory& lines) const {
  team_.sync();
  for (int i = rank(); i < state_.rim_points; i += size()) {
    const Sounding& s = state_.sounding[i];
    const Piece& piece = memory_.pieces[piece_at_rim(i)];
    const Vector3 x = state_.frame.at(s.at, s.height);
    lines.place[i] = {CurvePlaces<Team>::nearest_on(piece, x, kOffEnd * state_.reach), piece_at_rim(i)};
  }
  const double most = greater(bodies_.a.shape->diagonal, bodies_.b.shape->diagonal);
  return OverlapLines<Team>(team_, bodies_, memory_, summary_, lines).go_inside(state_.rim_points, most);
}

/// Asks for the surfaces beside a point, along the normal that its piece gives if its triangles face each
/// other. Else one of these is a wall that ends the patch, and its normal leads to nothing that faces the
/// other: in round 0 the line goes along a's, in round 1 along b's.
template <typename Team>
TANDEM_HD void SheetFinder<Team>::ask_across(int i, int round, const Vector3& from, std::uint32_t piece,
                                             bool is_inside, LineMemory& lines) const {
  const std::uint32_t(&triangle)[2] = memory_.pieces[piece].triangle;
  Sheet sheet;
  const bool faces = find_sheet(bodies_, triangle, sheet) > 0;
  PatchFrame& frame = lines.frame[i];
  for (int side = 0; side < 2; ++side)
    lines.line[2 * i + side].frame = &frame, lines.line[2 * i + side].side = -1;
  if (!is_inside || (faces && round > 0)) return;
  const Vector3 across = faces        ? sheet.normal
                         : round == 0 ? bodies_.a.triangle(triangle[0]).normal
                                      : -bodies_.b.triangle(triangle[1]).normal;
  frame = PatchFrame(from, across);
  LineQuestions questions(bodies_, lines.line);
  for (int side = 0; side < 2; ++side)
    questions.ask(static_cast<std::uint32_t>(2 * i + side), frame, side, side == 0 ? 1 : -1, {}, 0,
                  side == 0 ? 0 : -INFINITY, side == 0 ? INFINITY : 0, state_.reach / 4, kGrazes);
}

/// Takes what a line met if that is thin, and thinner than what was found before.
template <typename Team>
TANDEM_HD void SheetFinder<Team>::take_across(const LineQuestion& top, const LineQuestion& bottom,
                                              Sheet& best) const {
  Sheet sheet;
  if (top.side < 0 || !(find_sheet(bodies_, {top.best.triangle, bottom.best.triangle}, sheet) > 0)) return;
  const double thickness = top.best.height - bottom.best.height;
  sheet.depth = thickness * dot(sheet.normal, top.frame->n);
  sheet.half = (thickness / 2) * top.frame->n;
  sheet.at = top.frame->at({}, (top.best.height + bottom.best.height) / 2);
  sheet.found = sheet.depth <= kSheet * state_.reach;
  if (sheet.found && !(best.found && best.depth <= sheet.depth)) best = sheet;
}

/// Looks across the overlap beside each point of the rim, and at the seeds.
template <typename Team>
TANDEM_HD_CALLED void SheetFinder<Team>::look_across(const Seeds& seeds, LineMemory& lines) {
  const int rim = state_.rim_points, count = rim + seeds.count;
  const std::uint32_t beside_rim = go_beside_rim(lines);
  for (int i = rank(); i < count; i += size()) state_.sheet[i].found = false;
  const LineQuestions questions(bodies_, lines.line);
  for (int round = 0; round < 2; ++round) {
    team_.sync();
    for (int i = rank(); i < count; i += size()) {
      const bool at_rim = i < rim;
      ask_across(i, round, at_rim ? lines.inside[i] : seeds.at[i - rim],
                 at_rim ? piece_at_rim(i) : seeds.beside[i - rim], !at_rim || (beside_rim >> i & 1u) != 0,
                 lines);
    }
    team_.sync();
    walk_lines(team_, questions, 2 * static_cast<std::uint32_t>(count));
    for (int i = rank(); i < count; i += size())
      take_across(lines.line[2 * i], lines.line[2 * i + 1], state_.sheet[i]);
  }
  team_.sync();
  const bool concave = is_concave(count);
  if (team_.rank() == 0) {
    int thin[2] = {};  // beside the rim, and at the seeds
    for (int i = 0; i < count; ++i) thin[i < rim ? 0 : 1] += state_.sheet[i].found ? 1 : 0;
    state_.sheets = count;
    state_.bent = concave && thin[0] >= kFewestThin && 2 * thin[0] >= rim && 2 * thin[1] >= seeds.count;
  }
  team_.sync();
}

/// Returns whether some corners show that a body goes on before a triangle of a sheet, and so is not convex.
template <typename Team>
TANDEM_HD bool SheetFinder<Team>::is_concave(int sheets) const {
  constexpr std::uint32_t kCorners = 32;
  bool goes_on = false;
  for (int i = rank(); i < 2 * sheets; i += size()) {
    const Sheet& sheet = state_.sheet[i / 2];
    if (!sheet.found) continue;
    const Body& body = bodies_[i % 2];
    const WorldTriangle of = body.triangle(sheet.triangle[i % 2]);
    for (std::uint32_t k = 0; k < kCorners && !goes_on; ++k) {
      const auto t = static_cast<std::uint32_t>(std::uint64_t{k} * body.shape->triangle_count / kCorners);
      goes_on = dot(of.normal, body.corner(t, 0) - of.corner[0]) > kNearEnd * body.shape->diagonal;
    }
  }
  return team_.any(goes_on);
}

}  // namespace tandem::manifold
