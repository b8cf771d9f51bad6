#pragma once
#include "kernels/manifold/contact_curves.h"
#include "kernels/manifold/surface_line.h"

namespace tandem::manifold {

/// Follows straight lines through the overlap of two bodies.
template <typename Team>
class OverlapLines {
 public:
  /// shared: two questions, which all of the team see.
  TANDEM_HD OverlapLines(const Team& team, const BodyPair& bodies, const PieceMemory& memory,
                         LineQuestion* shared)
      : team_(team), bodies_(bodies), memory_(memory), shared_(shared) {}

  /// Returns the piece of order[begin] to order[end - 1] that is nearest to a point (sign 1) or furthest from
  /// all of some points (-1); of several the one of the least triangles.
  TANDEM_HD std::uint32_t extreme_piece(std::uint32_t begin, std::uint32_t end, const Vector3* from,
                                        int points, double sign) const;

  /// Finds a point of the overlap: half-way from the middle of a piece, behind both triangles, to where the
  /// overlap ends on that line, but no further than `most`. False where the triangles face each other.
  TANDEM_HD_SELDOM bool go_inside(std::uint32_t piece, double most, Vector3& inside) const;

  /// Returns whether a straight line meets the surface of neither body from `first` to `last`: a is 0, b
  /// is 1. It may begin on a surface.
  TANDEM_HD_SELDOM bool is_free(const Vector3& from, const Vector3& to, std::uint32_t first,
                                std::uint32_t last) const;

 private:
  /// Looks for the crossing of each body that is nearest to where the line begins.
  TANDEM_HD void follow(const PatchFrame& line, double length, std::uint32_t first, std::uint32_t last) const;

  const Team& team_;
  const BodyPair& bodies_;
  const PieceMemory& memory_;
  LineQuestion* shared_;
};

template <typename Team>
TANDEM_HD std::uint32_t OverlapLines<Team>::extreme_piece(std::uint32_t begin, std::uint32_t end,
                                                          const Vector3* from, int points,
                                                          double sign) const {
  double least = INFINITY;
  LeastPiece own;
  for (std::uint32_t i = begin + team_.rank(); i < end; i += team_.size()) {
    const std::uint32_t at = memory_.order[i];
    const Vector3 middle = memory_.pieces[at].middle();
    double nearest = INFINITY;
    for (int k = 0; k < points; ++k) nearest = lesser(dot(middle - from[k], middle - from[k]), nearest);
    const double distance = sign * nearest;
    if (distance < least) least = distance, own = {};
    if (distance == least) own.take(memory_.pieces[at].symmetric_key(), at);
  }
  const double least_of_all = team_.least(least);
  if (least != least_of_all) own = {};
  const std::uint64_t key = team_.least(own.key);
  return team_.least(own.key == key ? own.piece : kNoIndex);
}

template <typename Team>
TANDEM_HD void OverlapLines<Team>::follow(const PatchFrame& line, double length, std::uint32_t first,
                                          std::uint32_t last) const {
  LineQuestions questions(bodies_, line, shared_);
  const double begin = greater(bodies_.tolerance(), 1e-9 * length);
  team_.sync();
  for (std::uint32_t side = team_.rank(); side < 2; side += team_.size()) {
    shared_[side].side = -1;
    if (side < first || side > last) continue;
    questions.ask(side, static_cast<int>(side), 0, {}, begin, begin, length, INFINITY);
  }
  team_.sync();
  walk_lines(team_, questions, 2, shared_);
}

template <typename Team>
TANDEM_HD_SELDOM bool OverlapLines<Team>::go_inside(std::uint32_t piece, double most, Vector3& inside) const {
  const float* n = memory_.normals + 6 * std::size_t{piece};
  const Vector3 sum = {-double{n[0]} - double{n[3]}, -double{n[1]} - double{n[4]},
                       -double{n[2]} - double{n[5]}};
  const double length = norm(sum);
  if (!(length > 1e-3)) return false;
  const Piece& of = memory_.pieces[piece];
  Vector3 middle = 0.5 * (of.end[0] + of.end[1]);
  if (of.kind() == MeetingKind::polygon) {
    Meeting meeting;
    meet_again(bodies_, of, meeting);
    middle = {};
    for (int k = 0; k < meeting.corners; ++k) middle = middle + (1.0 / meeting.corners) * meeting.corner[k];
  }
  const PatchFrame line(middle, (1 / length) * sum);
  follow(line, most, 0, 1);
  double end = most;
  for (int side = 0; side < 2; ++side) {
    const Crossing& crossing = shared_[side].best;
    if (crossing.found()) end = lesser(crossing.height, end);
  }
  team_.sync();  // all have read the answers
  inside = line.at({}, end / 2);
  return true;
}

template <typename Team>
TANDEM_HD_SELDOM bool OverlapLines<Team>::is_free(const Vector3& from, const Vector3& to, std::uint32_t first,
                                                  std::uint32_t last) const {
  const double length = norm(to - from);
  if (!(length > 2 * bodies_.tolerance())) return true;
  follow(PatchFrame(from, (1 / length) * (to - from)), length, first, last);
  bool is = true;
  for (std::uint32_t side = first; side <= last; ++side) is = is && !shared_[side].best.found();
  team_.sync();  // all have read the answers
  return is;
}

}  // namespace tandem::manifold
