#pragma once
#include "kernels/manifold/patch.h"

namespace tandem::manifold {

/// A corner of the rim that adds less than this part to its area is left out; and of a rim of two corners one
/// that adds less than this part of their distance's square.
inline constexpr float kLittle = 1e-4f, kThin = 1e-5f;

/// The candidates of a patch: the ends and corners of its pieces, seen along its normal.
template <typename Team>
class RimFinder {
 public:
  TANDEM_HD RimFinder(const Team& team, const BodyPair& bodies, const PieceMemory& memory,
                      const PieceSummary& summary, std::uint32_t curve, const PatchFrame& frame,
                      std::uint32_t candidates = 0)
      : team_(team),
        bodies_(bodies),
        memory_(memory),
        summary_(summary),
        begin_(memory.start[curve]),
        end_(memory.start[curve + 1]),
        frame_(frame),
        count_(candidates) {}

  /// Writes down the candidates. each_end_twice: pieces share their ends, so one of each will do. next: a
  /// number that all of the team see. Where that was done before, their number is given instead.
  TANDEM_HD void gather(bool each_end_twice, std::uint32_t& next);

  /// The middle of the area within the curve, in the plane; false where it has none. Condition: gather().
  TANDEM_HD bool middle_of_area(Vector2& middle) const;
  TANDEM_HD std::uint32_t count() const { return count_; }

  /// Starts with the candidates furthest from each other, or nearly, and takes in again and again the one
  /// that adds most to the area.
  TANDEM_HD void find(int most, const Vector2& middle, RimMemory& shared) const;

  TANDEM_HD Vector3 position(std::uint32_t reference) const;
  TANDEM_HD std::uint64_t feature(std::uint32_t reference) const;
  TANDEM_HD const Piece& piece(std::uint32_t reference) const { return memory_.pieces[reference / 8]; }

  /// A point of the rim is called by the least feature of its own and of candidates closer than `distance`.
  /// That of the deepest line is told apart by the patch's key. points: that all of the team see.
  TANDEM_HD void name_points(Chosen* points, int count, double distance, std::uint64_t patch_key) const;

 private:
  TANDEM_HD Candidate* candidates() const {
    return reinterpret_cast<Candidate*>(memory_.table + PieceMemory::kTableWords * std::size_t{begin_});
  }
  TANDEM_HD void add(const Vector3& x, std::uint32_t reference, std::uint32_t& next) {
    const Vector2 at = frame_.flat(x);
    candidates()[team_.add(next, 1)] = {static_cast<float>(at.x), static_cast<float>(at.y), reference};
  }
  /// No coordinate of a candidate is larger.
  TANDEM_HD float unit() const { return 2 * static_cast<float>(summary_.unit); }
  template <int kWanted>
  TANDEM_HD void furthest(const RimValue (&values)[kWanted], Furthest (&best)[kWanted]) const;

  const Team& team_;
  const BodyPair& bodies_;
  const PieceMemory& memory_;
  const PieceSummary& summary_;
  std::uint32_t begin_, end_;
  const PatchFrame& frame_;
  std::uint32_t count_;
  RimMoments moments_;
};

template <typename Team>
TANDEM_HD void RimFinder<Team>::gather(bool each_end_twice, std::uint32_t& next) {
  const double one_by_unit = 1 / summary_.unit;
  const auto add_moments = [&](double twice_area, const Vector2& three_middles) {
    moments_.twice_area.add(twice_area, one_by_unit * one_by_unit);
    const double area_in_units = twice_area * one_by_unit * one_by_unit / 3;
    moments_.x.add(area_in_units * three_middles.x, one_by_unit);
    moments_.y.add(area_in_units * three_middles.y, one_by_unit);
  };
  if constexpr (HasLanes<Team>) {
    if (!summary_.degenerate) {  // there are no polygons
      count_ = team_.lanes().gather_rim(memory_, begin_, end_, frame_, one_by_unit, each_end_twice ? 1 : 2,
                                        candidates(), moments_);
      return;
    }
  }
  if (team_.rank() == 0) team_.store(next, 0);
  team_.sync();
  Meeting meeting;
  for (std::uint32_t i = begin_ + team_.rank(); i < end_; i += team_.size()) {
    const std::uint32_t at = memory_.order[i];
    const Piece& piece = memory_.pieces[at];
    if (piece.kind() == MeetingKind::polygon) {
      if (!piece.facing()) continue;
      meet_again(bodies_, piece, meeting);
      for (int k = 0; k < meeting.corners; ++k) {
        add(meeting.corner[k], at * 8 + 2 + static_cast<std::uint32_t>(k), next);
      }
      // Half of the polygon: the segments around it have the rest.
      Vector2 corner[kMostCorners], sum;
      double twice_area = 0;
      for (int k = 0; k < meeting.corners; ++k) corner[k] = frame_.flat(meeting.corner[k]);
      for (int k = 1; k + 1 < meeting.corners; ++k) {
        const double part = std::fabs(cross(corner[k] - corner[0], corner[k + 1] - corner[0]));
        twice_area += part;
        sum = sum + part * (corner[0] + corner[k] + corner[k + 1]);
      }
      if (twice_area > 0) add_moments(twice_area / 2, (1 / twice_area) * sum);
      continue;
    }
    for (std::uint32_t end = 0; end < (each_end_twice ? 1u : 2u); ++end)
      add(piece.end[end], at * 8 + end, next);
    const Vector2 x = frame_.flat(piece.end[0]), y = frame_.flat(piece.end[1]);
    add_moments(piece.weight() * cross(x, y), x + y);
  }
  team_.sync();
  count_ = team_.load(next);
  add_up(team_, moments_.twice_area, moments_.x, moments_.y);
}

template <typename Team>
TANDEM_HD bool RimFinder<Team>::middle_of_area(Vector2& middle) const {
  const double unit = summary_.unit, twice_area = moments_.twice_area.value(unit * unit);
  if (!(twice_area > 0x1p-30 * (unit * unit))) return false;
  const double by_area = unit * unit / twice_area;
  middle = {by_area * moments_.x.value(unit), by_area * moments_.y.value(unit)};
  return true;
}

/// Finds for each value the candidate that has the greatest one, if it is greater than what is given.
template <typename Team>
template <int kWanted>
TANDEM_HD void RimFinder<Team>::furthest(const RimValue (&values)[kWanted], Furthest (&best)[kWanted]) const {
  if constexpr (HasLanes<Team>)
    return team_.lanes().furthest(memory_, candidates(), count_, values, unit(), kWanted, best);
  float greatest[kWanted];
  for (int k = 0; k < kWanted; ++k) greatest[k] = best[k].value;
  for (std::uint32_t i = team_.rank(); i < count_; i += team_.size()) {
    for (int k = 0; k < kWanted; ++k) greatest[k] = greater(values[k](candidates()[i]), greatest[k]);
  }
  team_.greatest_ones(greatest);
  float limit[kWanted];
  for (int k = 0; k < kWanted; ++k) {
    limit[k] = greatest[k] > best[k].value ? greatest[k] - values[k].tied(greatest[k], unit()) : INFINITY;
    best[k].value = greatest[k];
  }
  for (std::uint32_t i = team_.rank(); i < count_; i += team_.size()) {
    const Candidate& c = candidates()[i];
    for (int k = 0; k < kWanted; ++k) {
      if (values[k](c) >= limit[k]) best[k].take(memory_, c.reference);
    }
  }
  if (team_.size() == 1) return;
  std::uint64_t own[kWanted], least[kWanted];
  for (int k = 0; k < kWanted; ++k) {
    const bool mine = best[k].reference != kNoIndex;
    least[k] = own[k] = mine ? Furthest::key(memory_, best[k].reference) : ~std::uint64_t{0};
  }
  team_.least_ones(least);
  std::uint32_t reference[kWanted];
  for (int k = 0; k < kWanted; ++k)
    reference[k] = own[k] != ~std::uint64_t{0} && own[k] == least[k] ? best[k].reference : kNoIndex;
  team_.least_ones(reference);
  for (int k = 0; k < kWanted; ++k) best[k].reference = reference[k];
}

template <typename Team>
TANDEM_HD void RimFinder<Team>::find(int most, const Vector2& middle, RimMemory& shared) const {
  Rim& rim = shared.rim;
  float limit = 0, area = 0, reach = 0;
  // The first of the team writes what is shared, after all have found the furthest together.
  const bool is_first = team_.rank() == 0;
  if (is_first) rim.points = 0, shared.first = 0, shared.second = 1, shared.complete = false;
  team_.sync();
  const auto insert = [&](int where, std::uint32_t reference) {
    const int rank = rim.points++;
    for (int i = rank; i > where; --i) {
      rim.reference[i] = rim.reference[i - 1], rim.at[i] = rim.at[i - 1], rim.rank[i] = rim.rank[i - 1];
      shared.of_side[i] = shared.of_side[i - 1];
    }
    const Vector2 at = frame_.flat(position(reference));
    rim.reference[where] = reference, rim.rank[where] = rank;
    rim.at[where] = {static_cast<float>(at.x), static_cast<float>(at.y)};
  };
  while (rim.points < most && !shared.complete) {
    // First the candidate furthest from the middle, then that furthest from it; later on, what lies beyond
    // the sides that are new.
    const bool begins = rim.points < 2;
    const int first = shared.first, second = shared.second;
    const FloatPoint from =
        rim.points > 0 ? rim.at[0] : FloatPoint{static_cast<float>(middle.x), static_cast<float>(middle.y)};
    const auto value = [&](int i) {
      return begins ? RimValue{from, from, true}
                    : RimValue{rim.at[i], rim.at[i + 1 == rim.points ? 0 : i + 1], false};
    };
    const RimValue values[] = {value(first), value(second)};
    const float than = rim.points == 0 ? -1.0f : 0.0f;
    Furthest found[2] = {{than, kNoIndex}, {than, kNoIndex}};
    furthest(values, found);
    if (begins) reach = std::sqrt(greater(found[0].value, 0.0f));
    team_.sync();  // all have read what is shared
    if (is_first && begins) {
      shared.complete = found[0].reference == kNoIndex;
      if (!shared.complete) insert(rim.points, found[0].reference), limit = kThin * found[0].value;
    } else if (is_first) {
      shared.of_side[first] = found[0], shared.of_side[second] = found[1];
      int side = 0;
      for (int i = 1; i < rim.points; ++i)
        side = shared.of_side[i].value - kTiedOnRim * unit() * reach > shared.of_side[side].value ? i : side;
      const Furthest best = shared.of_side[side];
      shared.complete = !(best.value > limit);
      if (!shared.complete) {
        area += best.value;
        limit = kLittle * area;
        insert(side + 1, best.reference);
        shared.first = side, shared.second = side + 1;
      }
    }
    team_.sync();
  }
}

template <typename Team>
TANDEM_HD Vector3 RimFinder<Team>::position(std::uint32_t reference) const {
  const Piece& of = piece(reference);
  const std::uint32_t number = reference & 7u;
  if (number < 2) return of.end[number];
  Meeting meeting;
  meet_again(bodies_, of, meeting);
  return meeting.corner[number - 2];
}

TANDEM_HD inline std::uint64_t feature_hash(std::uint64_t x, std::uint64_t y) {
  const std::uint64_t hash = mixed(mixed(x + 0x9E3779B97F4A7C15u) ^ y);
  return hash == 0 ? 1 : hash;
}

/// Returns the name of a candidate: by the edge or vertex of one body and the triangle of the other that meet
/// there.
template <typename Team>
TANDEM_HD std::uint64_t RimFinder<Team>::feature(std::uint32_t reference) const {
  const Piece& of = piece(reference);
  const std::uint32_t number = reference & 7u;
  if (number >= 2) return feature_hash(of.key(), 6 + number);
  const TriangleFeature f = of.feature(static_cast<int>(number));
  const int side = f.of_b != 0 ? 1 : 0;
  const TriangleTopology& own = bodies_[side].shape->topology[of.triangle[side]];
  const std::uint64_t part = f.is_corner != 0 ? own.vertex[f.number] : edge_key(own, f.number);
  return feature_hash(mixed(part + 1) ^ of.triangle[1 - side],
                      (f.of_b != 0 ? 2u : 0u) + (f.is_corner != 0 ? 1u : 0u));
}

template <typename Team>
TANDEM_HD void RimFinder<Team>::name_points(Chosen* points, int count, double distance,
                                            std::uint64_t patch_key) const {
  constexpr int kMost = kMostManifoldPoints;
  FloatPoint at[kMost] = {};
  std::uint64_t least[kMost];
  for (int k = 0; k < kMost; ++k) {
    const bool is_rim = k < count && !points[k].deepest;
    least[k] = is_rim ? points[k].feature : 0;
    // Nothing is near one that is not a number.
    at[k] = is_rim ? FloatPoint{static_cast<float>(points[k].at.x), static_cast<float>(points[k].at.y)}
                   : FloatPoint{NAN, NAN};
  }
  const auto square = static_cast<float>(distance * distance);
  if constexpr (HasLanes<Team>) {
    for (int k = 0; k < count; ++k) {
      const auto next = [&](std::uint32_t from) {
        return team_.lanes().next_near(candidates(), from, count_, at[k], square);
      };
      if (points[k].deepest) continue;
      for (std::uint32_t i = next(0); i < count_; i = next(i + 1))
        least[k] = lesser(least[k], feature(candidates()[i].reference));
    }
  } else {
    for (std::uint32_t i = team_.rank(); i < count_; i += team_.size()) {
      const Candidate& c = candidates()[i];
      for (int k = 0; k < kMost; ++k) {
        const float x = c.x - at[k].x, y = c.y - at[k].y;
        if (!(x * x + y * y < square)) continue;
        least[k] = lesser(least[k], feature(c.reference));
      }
    }
  }
  team_.least_ones(least);
  team_.sync();
  if (team_.rank() == 0) {
    for (int k = 0; k < count; ++k) {
      std::uint64_t& name = points[k].feature;
      name = points[k].deepest ? feature_hash(name, patch_key) : least[k];
      // Far from the origin, where tolerance() is as large as triangles, one feature may be at two places.
      for (int i = 0; i < k; ++i) {
        if (points[i].feature == name) name = feature_hash(name, 10 + static_cast<std::uint64_t>(k));
      }
    }
  }
  team_.sync();
}

/// Returns the place nearest to the point of the rim, on the way to the sounding's line, to which the
/// triangles of both bodies reach that the line met, and their heights there.
TANDEM_HD inline Vector2 reach_to_rim(const BodyPair& bodies, const PatchFrame& frame, const Sounding& s,
                                      double (&height)[2]) {
  constexpr double kOutside = 1e-12;  // a point is outside if its share of a corner is further below 0
  double share[2][3], change[2][3], of[2][3], part = 0;
  for (int side = 0; side < 2; ++side) {
    Vector2 at[3], from_line[3];
    for (int k = 0; k < 3; ++k) {
      const Vector3 x = bodies[side].corner(s.surface[side].triangle, k);
      at[k] = frame.flat(x) - s.at, of[side][k] = frame.height(x);
      from_line[k] = at[k] + s.at - s.line;
    }
    const double area = cross(at[1] - at[0], at[2] - at[0]);
    for (int k = 0; k < 3; ++k) {
      const int p = (k + 1) % 3, q = (k + 2) % 3;
      share[side][k] = cross(at[p], at[q]) / area;
      change[side][k] = cross(from_line[p], from_line[q]) / area - share[side][k];
      if (share[side][k] < -kOutside && change[side][k] > 0)
        part = greater(lesser(-share[side][k] / change[side][k], 1.0), part);
    }
  }
  for (int side = 0; side < 2; ++side) {
    height[side] = 0;
    for (int k = 0; k < 3; ++k) height[side] += (share[side][k] + part * change[side][k]) * of[side][k];
  }
  return s.at + part * (s.line - s.at);
}

}  // namespace tandem::manifold
