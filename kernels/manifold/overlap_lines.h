#pragma once
#include "kernels/manifold/contact_curves.h"
#include "kernels/manifold/surface_line.h"

namespace tandem::manifold {

/// A straight line that ends on a surface stays within it if it meets none before this last part: faces of
/// float32 corners are not quite flat.
inline constexpr double kNearEnd = 1e-6;

/// A place on a curve that is chosen for where it is lies at least this part of the curve's reach beside the
/// ends of its piece, if the piece is long enough: at an end both triangles of an edge have it, and rounding
/// decides.
inline constexpr double kOffEnd = 0x1p-10;

/// Values that differ by no more than this part of them are equal but for rounding, as distances of the
/// corners of a rectangle from its middle. Numbers of triangles decide between them, or bodies that are
/// turned together would have other manifolds.
inline constexpr double kTied = 1e-9;

/// Adding this number to one of about 1 and taking it off again leaves some 30 bits behind the point, so that
/// values that are equal but for rounding become equal.
inline constexpr double kCoarse = 0x1p22;

/// A place on a curve. It is found by its coordinates, and by numbers of triangles only between equal ones,
/// so it hardly depends on how the surfaces are cut into triangles.
struct Place {
  Vector3 at;
  std::uint32_t piece;
};

/// Finds places on the pieces order[begin] to order[end - 1].
template <typename Team>
class CurvePlaces {
 public:
  TANDEM_HD CurvePlaces(const Team& team, const PieceMemory& memory) : team_(team), memory_(memory) {}

  /// Returns the place that is nearest to a point. reach: of the pieces.
  TANDEM_HD Place nearest_place(std::uint32_t begin, std::uint32_t end, const Vector3& from,
                                double reach) const {
    const std::uint32_t piece = least_piece(begin, end, reach, [&](const Piece& of) {
      const Vector3 apart = nearest_on(of, from, kOffEnd * reach) - from;
      return dot(apart, apart);
    });
    return {nearest_on(memory_.pieces[piece], from, kOffEnd * reach), piece};
  }
  /// Returns the place that has most of a convex function, which grows as squares of distances do. That is an
  /// end of a piece, and none between pieces into which a straight one is cut.
  template <typename Value>
  TANDEM_HD Place furthest_place(std::uint32_t begin, std::uint32_t end, double reach,
                                 const Value& value) const {
    Vector3 p, q;
    const std::uint32_t piece = least_piece(begin, end, reach, [&](const Piece& of) {
      ends_of(of, reach, p, q);
      return -greater(value(p), value(q));
    });
    ends_of(memory_.pieces[piece], reach, p, q);
    return {value(p) >= value(q) - kTied * reach * reach ? p : q, piece};
  }
  /// Returns the point of a piece that is nearest to another one and not too near to its ends.
  TANDEM_HD static Vector3 nearest_on(const Piece& piece, const Vector3& from, double off_end);

 private:
  /// Returns the piece of the least value; of several that are equal but for rounding, that of the least
  /// triangles.
  template <typename Value>
  TANDEM_HD std::uint32_t least_piece(std::uint32_t begin, std::uint32_t end, double reach,
                                      const Value& value) const;

  /// The ends of a piece, but for a little.
  TANDEM_HD static void ends_of(const Piece& piece, double reach, Vector3& p, Vector3& q) {
    p = q = piece.end[0];
    if (piece.kind() == MeetingKind::polygon) return;
    const Vector3 along = piece.end[1] - p;
    const double length = norm(along), off_end = kOffEnd * reach;
    const Vector3 off = (length > 2 * off_end ? off_end / length : 0.5) * along;
    q = piece.end[1] - off, p = p + off;
  }

  const Team& team_;
  const PieceMemory& memory_;
};

/// Faces of two bodies may lie in each other, and a line that runs in both leaves neither. So lines that go
/// inside are tilted by this much if corners or edges lie in faces.
inline constexpr double kTilt = 0.125;

/// Says where lines that go inside begin: at pieces of the curve, behind their triangles; or at places within
/// the curve, in the direction that pieces give, or the other way.
enum class LineFrom : std::uint8_t { curve, within, within_and_back };

/// Lines that a team follows at once, each in a frame of its own where that is needed.
struct LineMemory {
  static constexpr int kMost = 20, kMostPlaces = 8;

  PatchFrame frame[kMost / 2];  ///< there are two lines in each
  LineQuestion line[kMost];
  Place place[kMostPlaces];
  Vector3 inside[kMostPlaces];  ///< points of the overlap, beside the places
};

/// Follows straight lines through the overlap of two bodies.
template <typename Team>
class OverlapLines {
 public:
  /// shared: what all of the team see.
  TANDEM_HD OverlapLines(const Team& team, const BodyPair& bodies, const PieceMemory& memory,
                         const PieceSummary& summary, LineMemory& shared)
      : team_(team), bodies_(bodies), memory_(memory), summary_(summary), shared_(shared) {}

  /// Finds a point of the overlap beside each of the first places: half-way from there, behind both
  /// triangles, to where the overlap ends on that line, but no further than `most`. Result: a bit for each
  /// place; 0 where its triangles face each other, or the line is not within both bodies. The first
  /// questions, `asked`, are others'; with them there are at most LineMemory::kMost.
  TANDEM_HD std::uint32_t go_inside(int count, double most, std::uint32_t asked = 0,
                                    LineFrom where = LineFrom::curve) const;

  /// Asks where a straight line within a, and one within b, from one point to two others meet the surface of
  /// the body, if they do so before they are there. The point is within both, perhaps hardly: a line that
  /// began further on could begin outside. first: the first of the two questions.
  TANDEM_HD void ask_straight(std::uint32_t first, const Vector3& from, const Vector3 (&to)[2]) const;

  /// Returns whether a straight line from one point inside to the next, of each pair that has a bit, stays
  /// within both bodies.
  TANDEM_HD bool any_is_free(std::uint32_t pairs, int count) const;

 private:
  /// Lines begin so far behind the surface from which they start.
  TANDEM_HD double behind(double length) const { return greater(bodies_.tolerance(), 1e-9 * length); }

  /// Returns a direction in the plane of a triangle that is hardly that of an edge, or across one.
  TANDEM_HD static Vector3 tangent(const WorldTriangle& t) {
    return normalized(0.31 * (t.corner[1] - t.corner[0]) + 0.57 * (t.corner[2] - t.corner[0]));
  }

  TANDEM_HD bool leaves(int side, const Crossing& crossing, const Vector3& direction) const {
    return dot(bodies_[side].triangle(crossing.triangle).normal, direction) > 0;
  }

  const Team& team_;
  const BodyPair& bodies_;
  const PieceMemory& memory_;
  const PieceSummary& summary_;
  LineMemory& shared_;
};

template <typename Team>
TANDEM_HD Vector3 CurvePlaces<Team>::nearest_on(const Piece& piece, const Vector3& from, double off_end) {
  if (piece.kind() == MeetingKind::polygon) return piece.end[0];
  const Vector3 along = piece.end[1] - piece.end[0];
  const double length = norm(along);
  if (!(length > 2 * off_end)) return piece.middle();
  const Vector3 e = (1 / length) * along;
  return piece.end[0] + lesser(greater(dot(e, from - piece.end[0]), off_end), length - off_end) * e;
}

template <typename Team>
template <typename Value>
TANDEM_HD std::uint32_t CurvePlaces<Team>::least_piece(std::uint32_t begin, std::uint32_t end, double reach,
                                                       const Value& value) const {
  const double coarse = kCoarse * reach * reach;
  double least = INFINITY;
  LeastPiece own;
  for (std::uint32_t i = begin + team_.rank(); i < end; i += team_.size()) {
    const std::uint32_t piece = memory_.order[i];
    const double about = (value(memory_.pieces[piece]) + coarse) - coarse;
    if (about > least) continue;
    if (about < least) least = about, own = {};
    own.take(memory_.pieces[piece].symmetric_key(), piece);
  }
  if (team_.least(least) != least) own = {};
  const std::uint64_t key = team_.least(own.key);
  return team_.least(own.key == key ? own.piece : kNoIndex);
}

template <typename Team>
TANDEM_HD std::uint32_t OverlapLines<Team>::go_inside(int count, double most, std::uint32_t asked,
                                                      LineFrom where) const {
  LineQuestions questions(bodies_, shared_.line);
  team_.sync();
  for (int i = static_cast<int>(team_.rank()); i < count; i += static_cast<int>(team_.size())) {
    const Place& place = shared_.place[i];
    const Piece& of = memory_.pieces[place.piece];
    // The normals that pieces have are rounded to float32, in another way where the bodies are turned.
    const WorldTriangle a = bodies_.a.triangle(of.triangle[0]);
    Vector3 along = -(a.normal + bodies_.b.triangle(of.triangle[1]).normal);
    const double length = norm(along);
    if (summary_.degenerate) along = along + kTilt * tangent(a);
    const auto line = asked + 2 * static_cast<std::uint32_t>(i);
    PatchFrame& frame = shared_.frame[line / 2];
    if (!(length > 1e-3)) {
      shared_.line[line].frame = shared_.line[line + 1].frame = &frame;
      shared_.line[line].side = shared_.line[line + 1].side = -1;
      continue;
    }
    Vector3 from = place.at;
    if (where == LineFrom::curve && of.kind() == MeetingKind::polygon) {
      Meeting meeting;
      meet_again(bodies_, of, meeting);
      from = {};
      for (int k = 0; k < meeting.corners; ++k) from = from + (1.0 / meeting.corners) * meeting.corner[k];
    }
    frame = PatchFrame(from, (where == LineFrom::within_and_back ? -1.0 : 1.0) * normalized(along));
    const double begin = behind(most);
    for (std::uint32_t side = 0; side < 2; ++side)
      questions.ask(line + side, frame, static_cast<int>(side), 0, {}, begin, begin, INFINITY, INFINITY,
                    kGrazes);
  }
  team_.sync();
  walk_lines(team_, questions, asked + 2 * static_cast<std::uint32_t>(count));
  std::uint32_t found = 0;
  for (int i = static_cast<int>(team_.rank()); i < count; i += static_cast<int>(team_.size())) {
    const LineQuestion* const line = shared_.line + asked + 2 * i;
    if (line->side < 0) continue;
    double end = most;
    bool within = true;
    for (int side = 0; side < 2; ++side) {
      const Crossing& crossing = line[side].best;
      // A line that runs in a flush face does not leave the body there, or comes back into it.
      within = within &&
               (crossing.found() ? leaves(side, crossing, line->frame->n) : !bodies_[side].shape->closed);
      if (crossing.found()) end = lesser(crossing.height, end);
    }
    shared_.inside[i] = line->frame->at({}, end / 2);
    found |= within ? 1u << i : 0u;
  }
  found = team_.sum(found);
  team_.sync();  // all see the points
  return found;
}

template <typename Team>
TANDEM_HD void OverlapLines<Team>::ask_straight(std::uint32_t first, const Vector3& from,
                                                const Vector3 (&to)[2]) const {
  LineQuestions questions(bodies_, shared_.line);
  for (std::uint32_t side = team_.rank(); side < 2; side += team_.size()) {
    const double length = norm(to[side] - from), begin = bodies_.tolerance();
    LineQuestion& line = shared_.line[first + side];
    line.frame = &shared_.frame[first + side];
    line.side = -1;
    line.length = length;
    line.best = {};
    if (!(length > 2 * begin)) continue;
    shared_.frame[first + side] = PatchFrame(from, (1 / length) * (to[side] - from));
    questions.ask(first + side, shared_.frame[first + side], static_cast<int>(side), 0, {}, begin, begin,
                  (1 - kNearEnd) * length, INFINITY, kGrazes);
  }
}

template <typename Team>
TANDEM_HD bool OverlapLines<Team>::any_is_free(std::uint32_t pairs, int count) const {
  team_.sync();
  for (int i = 0; i < count; ++i) {
    const Vector3& to = shared_.inside[2 * i + 1];
    if ((pairs >> i & 1u) != 0)
      ask_straight(2 * static_cast<std::uint32_t>(i), shared_.inside[2 * i], {to, to});
    else if (team_.rank() == 0)
      shared_.line[2 * i].side = shared_.line[2 * i + 1].side = -1;
  }
  team_.sync();
  LineQuestions questions(bodies_, shared_.line);
  walk_lines(team_, questions, 2 * static_cast<std::uint32_t>(count));
  bool any = false;
  for (int i = 0; i < count; ++i)
    any = any || ((pairs >> i & 1u) != 0 && !shared_.line[2 * i].best.found() &&
                  !shared_.line[2 * i + 1].best.found());
  team_.sync();  // all have read the answers
  return any;
}

}  // namespace tandem::manifold
