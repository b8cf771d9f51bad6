#pragma once
#include "kernels/manifold/overlap_lines.h"
#include "kernels/manifold/patch.h"

/// Curves that bound one connected region of the overlap are joined: the two rims of a ring that lies on a
/// plate, or where a rod enters a plate and where it leaves it. A straight line from one curve to the other
/// that stays within both bodies shows it. Within convex bodies all curves are joined so, because their
/// overlap is convex.
namespace tandem::manifold {

/// The memory that a team shares while it joins curves.
struct RegionMemory {
  LineMemory lines;
  std::uint32_t curves;
};

template <typename Team>
class RegionFinder {
 public:
  /// shared: what all of the team see; only try_to_join() and join() need it.
  TANDEM_HD RegionFinder(const Team& team, const BodyPair& bodies, const PieceMemory& memory,
                         const PieceSummary& summary, RegionMemory* shared)
      : team_(team), bodies_(bodies), memory_(memory), summary_(summary), shared_(shared) {}

  /// Each curve is compared with so many of the others, the nearest.
  static constexpr int kNeighbours = 7;

  /// Returns whether there are curves to be joined; not if there are too many.
  TANDEM_HD static bool may_join(const PieceSummary& summary) {
    return summary.curves > 1 && summary.curves < 256;  // a number takes a byte
  }

  /// Returns how many regions there are; afterwards `order` and `start` have them instead of curves, and the
  /// first piece of a region whose curves cancel each other is marked as joined.
  TANDEM_HD std::uint32_t find();

  /// These are the steps of find() where curves may be joined. Each is done with all curves, or neighbours,
  /// before the next one begins; teams may do so at once.
  TANDEM_HD void begin(std::uint32_t curve);
  TANDEM_HD void try_to_join(std::uint32_t curve, int k);
  TANDEM_HD std::uint32_t join();

 private:
  /// Area vectors agree if their sum is longer than this part of their lengths' sum.
  static constexpr double kAgree = 0.5;

  // The table has, of each curve: the area vector, the curve that it is joined to, a piece, where it goes,
  // and a byte for each neighbour that it is joined with: the neighbour's number and 1.
  TANDEM_HD Vector3& area_of(std::uint32_t curve) const {
    static_assert(sizeof(Vector3) == 24 && PieceMemory::kTableWords % 2 == 0);
    return reinterpret_cast<Vector3*>(memory_.table)[curve];
  }
  TANDEM_HD std::uint32_t& word(std::uint32_t kind, std::uint32_t at) const {
    return memory_.table[(6 + kind) * summary_.curves + at];
  }
  TANDEM_HD std::uint32_t& joined_to(std::uint32_t curve) const { return word(0, curve); }
  TANDEM_HD std::uint32_t& piece_of(std::uint32_t curve) const { return word(1, curve); }
  TANDEM_HD std::uint32_t& place_of(std::uint32_t curve) const { return word(2, curve); }
  TANDEM_HD std::uint32_t& partners_of(std::uint32_t curve, int half) const {
    return word(3, 2 * curve + static_cast<std::uint32_t>(half));
  }
  TANDEM_HD std::uint32_t first_of(std::uint32_t curve) const {
    while (joined_to(curve) != curve) curve = joined_to(curve);
    return curve;
  }
  TANDEM_HD void unite(std::uint32_t i, std::uint32_t j) const {
    const std::uint32_t p = first_of(i), q = first_of(j);
    joined_to(greater(p, q)) = lesser(p, q);
  }
  /// The place of a curve that is nearest to the middle of both bodies.
  TANDEM_HD Place place_in(std::uint32_t curve) const {
    const std::uint32_t piece = piece_of(curve);
    return {CurvePlaces<Team>::nearest_on(memory_.pieces[piece], bodies_.middle(), kOffEnd * reach()), piece};
  }
  /// A length that stays the same where the bodies are moved together.
  TANDEM_HD double reach() const { return bodies_.smaller_diagonal() / 2; }
  TANDEM_HD bool comes_first(std::uint32_t i, std::uint32_t than) const;
  TANDEM_HD std::uint32_t neighbour(std::uint32_t of, int k) const;
  TANDEM_HD bool is_joined(std::uint32_t i, std::uint32_t j);
  TANDEM_HD bool areas_agree(std::uint32_t first) const;
  TANDEM_HD std::uint32_t sort_by_region();

  const Team& team_;
  const BodyPair& bodies_;
  const PieceMemory& memory_;
  const PieceSummary& summary_;
  RegionMemory* shared_;
};

/// Tries lines from two places of the first curve, each to the nearest one of the second. They lead from
/// beside a place to beside another one.
template <typename Team>
TANDEM_HD bool RegionFinder<Team>::is_joined(std::uint32_t i, std::uint32_t j) {
  const OverlapLines<Team> lines(team_, bodies_, memory_, shared_->lines);
  const CurvePlaces<Team> places(team_, memory_);
  const auto nearest = [&](std::uint32_t curve, const Place& from) {
    return places.nearest_place(memory_.start[curve], memory_.start[curve + 1], from.at, reach());
  };
  constexpr int kAttempts = 2;
  const Place first = place_in(i);
  double most = 0;
  team_.sync();  // all are done with the places before
  for (int k = 0; k < kAttempts; ++k) {
    const Place from =
        k == 0 ? nearest(i, nearest(j, first))
               : places.furthest_place(memory_.start[i], memory_.start[i + 1], reach(),
                                       [&](const Vector3& x) { return dot(x - first.at, x - first.at); });
    const Place to = nearest(j, from);
    if (team_.rank() == 0) shared_->lines.place[2 * k] = from, shared_->lines.place[2 * k + 1] = to;
    most = greater(norm(to.at - from.at), most);
  }
  const std::uint32_t found = lines.go_inside(2 * kAttempts, most);
  std::uint32_t pairs = 0;
  for (int k = 0; k < kAttempts; ++k) pairs |= (found >> (2 * k) & 3u) == 3 ? 1u << k : 0u;
  return pairs != 0 && lines.any_is_free(pairs, kAttempts);
}

/// Returns whether the area vectors of the curves of a region add up, rather than cancel. Then the region is
/// like one of a single curve.
template <typename Team>
TANDEM_HD bool RegionFinder<Team>::areas_agree(std::uint32_t first) const {
  Vector3 sum;
  double sizes = 0;
  for (std::uint32_t c = first; c < summary_.curves; ++c) {
    if (joined_to(c) != first) continue;
    sum = sum + area_of(c), sizes += norm(area_of(c));
  }
  return norm(sum) > kAgree * sizes;
}

/// Puts the pieces of a region behind each other.
template <typename Team>
TANDEM_HD std::uint32_t RegionFinder<Team>::sort_by_region() {
  const std::uint32_t curves = summary_.curves;
  // Each finds its first curve while none changes, and then where its pieces go: behind those of regions that
  // begin before, and of earlier curves of its own.
  for (std::uint32_t c = team_.rank(); c < curves; c += team_.size()) place_of(c) = first_of(c);
  team_.sync();
  for (std::uint32_t c = team_.rank(); c < curves; c += team_.size()) joined_to(c) = place_of(c);
  team_.sync();
  for (std::uint32_t c = team_.rank(); c < curves; c += team_.size()) {
    std::uint32_t place = 0;
    for (std::uint32_t d = 0; d < curves; ++d) {
      const bool before = joined_to(d) < joined_to(c) || (joined_to(d) == joined_to(c) && d < c);
      place += before ? memory_.start[d + 1] - memory_.start[d] : 0;
    }
    place_of(c) = place;
  }
  team_.sync();
  for (std::uint32_t first = 0; first < curves; ++first) {
    bool several = false;
    for (std::uint32_t c = first + 1 + team_.rank(); c < curves; c += team_.size())
      several = several || joined_to(c) == first;
    several = team_.any(several);
    // The first curve of a region comes first in it, so what it begins with is where the region begins.
    if (several && !areas_agree(first) && team_.rank() == 0)
      memory_.pieces[memory_.order[memory_.start[first]]].joined = 1;
  }
  for (std::uint32_t i = team_.rank(); i < summary_.pieces; i += team_.size()) {
    std::uint32_t c = 0;  // the last curve that begins no later
    for (std::uint32_t step = 128; step > 0; step /= 2)
      c += c + step < curves && memory_.start[c + step] <= i ? step : 0;
    memory_.curve[place_of(c) + i - memory_.start[c]] = memory_.order[i];
  }
  team_.sync();
  for (std::uint32_t i = team_.rank(); i < summary_.pieces; i += team_.size())
    memory_.order[i] = memory_.curve[i];
  team_.sync();
  if (team_.rank() == 0) {
    std::uint32_t regions = 0;
    for (std::uint32_t c = 0; c < curves; ++c) {
      if (joined_to(c) == c) memory_.start[regions++] = place_of(c);
    }
    memory_.start[regions] = summary_.pieces;
    shared_->curves = regions;
  }
  team_.sync();
  return shared_->curves;
}

template <typename Team>
TANDEM_HD void RegionFinder<Team>::begin(std::uint32_t curve) {
  const std::uint32_t first = memory_.start[curve], end = memory_.start[curve + 1];
  const Place place = CurvePlaces<Team>(team_, memory_).nearest_place(first, end, bodies_.middle(), reach());
  CurveSums sums;
  for (std::uint32_t i = first + team_.rank(); i < end; i += team_.size())
    sums.add(memory_, memory_.order[i], summary_.origin, 1 / summary_.unit);
  add_up(team_, sums.area.x, sums.area.y, sums.area.z);
  if (team_.rank() == 0) {
    joined_to(curve) = curve;
    piece_of(curve) = place.piece;
    partners_of(curve, 0) = partners_of(curve, 1) = 0;
    area_of(curve) = sums.area.value(1);
  }
  team_.sync();
}

/// Returns the curve whose place is nearest to that of another one but for k; of equally near ones that
/// of the least triangles comes first. kNoIndex: there are not so many.
template <typename Team>
TANDEM_HD std::uint32_t RegionFinder<Team>::neighbour(std::uint32_t of, int k) const {
  const Vector3 from = place_in(of).at;
  double last_distance = -1;
  std::uint64_t last_key = 0;
  for (;; --k) {
    double least = INFINITY;
    LeastPiece own;  // the piece is the curve here
    for (std::uint32_t j = team_.rank(); j < summary_.curves; j += team_.size()) {
      const Vector3 apart = place_in(j).at - from;
      const double distance = dot(apart, apart);
      const std::uint64_t key = memory_.pieces[piece_of(j)].symmetric_key();
      const bool later = distance > last_distance || (distance == last_distance && key > last_key);
      if (j == of || !later || distance > least) continue;
      if (distance < least) least = distance, own = {};
      own.take(key, j);
    }
    const double least_of_all = team_.least(least);
    if (least != least_of_all) own = {};
    const std::uint64_t key = team_.least(own.key);
    if (key == ~std::uint64_t{0}) return kNoIndex;
    const std::uint32_t nearest = team_.least(own.key == key ? own.piece : kNoIndex);
    if (k == 0) return nearest;
    last_distance = least_of_all, last_key = key;
  }
}

/// Returns whether a curve is nearer to the middle of both bodies than another one; of equally near ones that
/// of the least triangles comes first.
template <typename Team>
TANDEM_HD bool RegionFinder<Team>::comes_first(std::uint32_t i, std::uint32_t than) const {
  const Vector3 middle = bodies_.middle(), p = place_in(i).at - middle, q = place_in(than).at - middle;
  const double of_p = dot(p, p), of_q = dot(q, q);
  if (std::fabs(of_p - of_q) > kTied * of_q) return of_p < of_q;
  return memory_.pieces[piece_of(i)].symmetric_key() < memory_.pieces[piece_of(than)].symmetric_key();
}

template <typename Team>
TANDEM_HD void RegionFinder<Team>::try_to_join(std::uint32_t curve, int k) {
  if (static_cast<std::uint32_t>(k) + 1 >= summary_.curves) return;
  const std::uint32_t other = neighbour(curve, k);
  if (other == kNoIndex) return;
  // Where all are each other's neighbours, the other way is tried as well.
  if (summary_.curves <= kNeighbours + 1 && comes_first(other, curve)) return;
  // One thread tries one neighbour after the other, and knows which curves are joined by now.
  if (team_.size() == 1 && first_of(curve) == first_of(other)) return;
  if (!is_joined(curve, other) || team_.rank() != 0) return;
  if (team_.size() == 1) unite(curve, other);
  team_.set_bits(partners_of(curve, k / 4), (other + 1) << (8 * (k % 4)));
}

template <typename Team>
TANDEM_HD std::uint32_t RegionFinder<Team>::join() {
  const std::uint32_t curves = summary_.curves;
  bool any = false;
  for (std::uint32_t c = team_.rank(); c < curves; c += team_.size())
    any = any || (partners_of(c, 0) | partners_of(c, 1)) != 0;
  if (!team_.any(any)) return curves;
  team_.sync();
  if (team_.rank() == 0) {
    for (std::uint32_t c = 0; c < curves; ++c) {
      for (std::uint32_t word = 0; word < 2; ++word) {
        for (std::uint32_t partners = partners_of(c, static_cast<int>(word)); partners != 0; partners >>= 8) {
          if ((partners & 0xFFu) == 0) continue;
          unite(c, (partners & 0xFFu) - 1);
        }
      }
    }
  }
  team_.sync();
  return sort_by_region();
}

template <typename Team>
TANDEM_HD std::uint32_t RegionFinder<Team>::find() {
  if (!may_join(summary_)) return summary_.curves;
  for (std::uint32_t c = 0; c < summary_.curves; ++c) begin(c);
  for (std::uint32_t c = 0; c < summary_.curves; ++c) {
    for (int k = 0; k < kNeighbours; ++k) try_to_join(c, k);
  }
  return join();
}

}  // namespace tandem::manifold
