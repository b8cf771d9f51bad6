#pragma once
#include "kernels/manifold/patch.h"

/// Where an edge of one body lies along a face of the other, the overlap is deep all along that edge, but at
/// the rim it has no depth: it rises from there to the edge. So lines between the points of the rim look for
/// where it is deep too. Without them one end of the edge would be a deep point and the other one none, and
/// which is which changes with the slightest turn.
namespace tandem::manifold {

/// A place between two points of the rim is a point of the patch if the overlap there is at least this part
/// of the deepest line. Between the corners of a hexagon in a round rim it is a quarter.
inline constexpr double kRidge = 0.6;

/// A point of the rim is shallow if the overlap there is less than this part of that at the ridge.
inline constexpr double kShallow = 0.5;

/// A line at a ridge runs beside it, by this part of the way between the points of the rim: on the ridge both
/// triangles have it, and rounding decides.
inline constexpr double kOffRidge = 0x1p-10;

/// Finds the ridges of a patch: PatchState::ridge.
template <typename Team>
class RidgeFinder {
 public:
  TANDEM_HD RidgeFinder(const Team& team, const BodyPair& bodies, PatchState& state)
      : team_(team), bodies_(bodies), state_(state) {}

  /// Conditions: the rim has been sounded, and the deepest line is known.
  TANDEM_HD void find(LineMemory& lines) const;

 private:
  /// A place between two points of the rim, and the heights there of the planes known of both bodies that
  /// leave the overlap least.
  struct Guess {
    Vector2 at;
    double height[2];
    TANDEM_HD double depth() const { return height[0] - height[1]; }
  };

  TANDEM_HD bool guess(int i, Guess& out) const;
  TANDEM_HD double plane_height(int side, std::uint32_t triangle, const Vector2& at) const;
  TANDEM_HD double overlap_of(const Sounding& s, const Vector2& at) const {
    return plane_height(0, s.surface[0].triangle, at) - plane_height(1, s.surface[1].triangle, at);
  }
  TANDEM_HD void bound(const std::uint32_t (&triangle)[2], Guess& guess) const {
    guess.height[0] = lesser(guess.height[0], plane_height(0, triangle[0], guess.at));
    guess.height[1] = greater(guess.height[1], plane_height(1, triangle[1], guess.at));
  }

  const Team& team_;
  const BodyPair& bodies_;
  PatchState& state_;
};

/// Returns the height at which a vertical line meets a triangle's plane.
template <typename Team>
TANDEM_HD double RidgeFinder<Team>::plane_height(int side, std::uint32_t triangle, const Vector2& at) const {
  Vector2 from[3];
  double height[3];
  for (int k = 0; k < 3; ++k) {
    const Vector3 x = bodies_[side].corner(triangle, k);
    from[k] = state_.frame.flat(x) - at, height[k] = state_.frame.height(x);
  }
  const double first = cross(from[1], from[2]), second = cross(from[2], from[0]),
               third = cross(from[0], from[1]);
  return (first * height[0] + second * height[1] + third * height[2]) / (first + second + third);
}

/// Guesses where the overlap is deepest between a point of the rim and the next. Result: whether it is deep
/// there, for all that is known. The planes of convex bodies leave no less than there is.
template <typename Team>
TANDEM_HD bool RidgeFinder<Team>::guess(int i, Guess& out) const {
  const Sounding &p = state_.sounding[i], &q = state_.sounding[i + 1 == state_.rim_points ? 0 : i + 1];
  if (!(p.overlap() > 0 && q.overlap() > 0)) return false;
  const double p_at_q = overlap_of(p, q.line), q_at_p = overlap_of(q, p.line);
  const double deeper_at_p = q_at_p - p.overlap(), deeper_at_q = p_at_q - q.overlap();
  if (!(deeper_at_p > 0 && deeper_at_q > 0)) return false;
  double part = deeper_at_p / (deeper_at_p + deeper_at_q);
  const bool is_flatter_to_q =
      std::fabs(q.overlap() - q_at_p) < (1 - kTied) * std::fabs(p_at_q - p.overlap());
  part += is_flatter_to_q ? kOffRidge * (1 - part) : -kOffRidge * part;
  out = {p.line + part * (q.line - p.line), {INFINITY, -INFINITY}};
  bound(state_.deepest.triangle, out);
  for (int k = 0; k < state_.rim_points; ++k) {
    const Sounding& s = state_.sounding[k];
    if (s.overlap() > 0) bound({s.surface[0].triangle, s.surface[1].triangle}, out);
  }
  const double depth = out.depth();
  return depth >= kRidge * state_.deepest.depth() && overlap_of(p, p.at) < kShallow * depth &&
         overlap_of(q, q.at) < kShallow * depth;
}

template <typename Team>
TANDEM_HD void RidgeFinder<Team>::find(LineMemory& lines) const {
  if (state_.kind != PatchKind::overlap || state_.bent || state_.ridges() < 3) return;
  const LineQuestions questions(bodies_, lines.line);
  bool asks = false;
  for (int i = static_cast<int>(team_.rank()); i < state_.rim_points; i += static_cast<int>(team_.size())) {
    Guess guessed;
    const bool is_deep = guess(i, guessed);
    asks = asks || is_deep;
    if (is_deep) state_.ridge[i].at = guessed.at;
    for (int side = 0; side < 2; ++side) {
      const std::uint32_t question = static_cast<std::uint32_t>(2 * i + side);
      lines.line[question].frame = &state_.frame;
      lines.line[question].side = -1;
      if (!is_deep) continue;
      questions.ask(question, state_.frame, side, side == 0 ? 1 : -1, guessed.at, guessed.height[side],
                    -INFINITY, INFINITY, state_.reach / 4, kWall);
    }
  }
  if (!team_.any(asks)) return;
  team_.sync();
  walk_lines(team_, questions, 2 * static_cast<std::uint32_t>(state_.rim_points));
  const double deepest = state_.deepest.depth();
  for (int i = static_cast<int>(team_.rank()); i < state_.rim_points; i += static_cast<int>(team_.size())) {
    OverlapLine& ridge = state_.ridge[i];
    if (lines.line[2 * i].side < 0) continue;
    for (int side = 0; side < 2; ++side) {
      const Crossing& crossing = lines.line[2 * i + side].best;
      ridge.triangle[side] = crossing.triangle, ridge.height[side] = crossing.height;
    }
    const bool counts =
        ridge.found() && ridge.depth() >= kRidge * deepest && ridge.depth() <= deepest * (1 + kDeepEnough);
    if (!counts) ridge = {};
  }
  team_.sync();
}

}  // namespace tandem::manifold
