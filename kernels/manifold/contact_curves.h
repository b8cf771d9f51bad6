#pragma once
#include <cstdint>

#include "kernels/manifold/body.h"
#include "kernels/manifold/exact_sum.h"
#include "kernels/manifold/team.h"
#include "tandem/kernels/contact_query.h"

/// The intersection of the surfaces of two bodies: what each pair of triangles has in common, joined to
/// curves.
namespace tandem::manifold {

/// The most contacts of a pair of bodies: pieces are numbered in 28 bits, and table entries in 32.
inline constexpr std::uint32_t kMostContactsOfPair = std::uint32_t{1} << 27;

/// The short form of what a pair of triangles has in common. Corners of polygons are computed again where
/// they are asked for.
struct alignas(16) Piece {
  std::uint32_t triangle[2];  ///< of a, of b
  std::uint32_t info;         ///< kind, facing, weights, features, and whether an end is free
  std::uint32_t joined;       ///< 1: of a region that several curves bound (region_finder.h)
  Vector3 end[2];             ///< of a polygon: a corner, and its share of the area vector

  TANDEM_HD MeetingKind kind() const { return static_cast<MeetingKind>(info & 3u); }
  TANDEM_HD bool facing() const { return (info & kFacing) != 0; }
  TANDEM_HD double weight() const { return 1 - 0.5 * (info / kParted & 3u); }
  TANDEM_HD TriangleFeature feature(int end_number) const {
    const std::uint32_t bits = info >> (8 + 4 * end_number);
    return {static_cast<std::uint8_t>(bits & 1u), static_cast<std::uint8_t>(bits >> 1 & 1u),
            static_cast<std::uint8_t>(bits >> 2 & 3u)};
  }
  TANDEM_HD std::uint64_t key() const { return std::uint64_t{triangle[0]} << 32 | triangle[1]; }
  /// A key whose order stays the same where the bodies are exchanged, but for pairs of the same numbers.
  TANDEM_HD std::uint64_t symmetric_key() const {
    static_assert(kMostTopologyTriangles <= std::uint32_t{1} << 30);
    const std::uint32_t s = triangle[0], t = triangle[1];
    return (std::uint64_t{lesser(s, t)} << 31 | greater(s, t)) << 1 | (s > t ? 1u : 0u);
  }
  /// The middle of a segment; of a polygon a corner.
  TANDEM_HD Vector3 middle() const {
    return kind() == MeetingKind::polygon ? end[0] : 0.5 * (end[0] + end[1]);
  }

  static constexpr std::uint32_t kFacing = 4, kParted = 8, kDegenerate = 32;
};
static_assert(sizeof(Piece) == 64);

TANDEM_HD inline std::uint32_t bits_of(const TriangleFeature& f) {
  return std::uint32_t{f.of_b} | std::uint32_t{f.is_corner} << 1 | std::uint32_t{f.number} << 2;
}

/// The piece of the least key.
struct LeastPiece {
  std::uint64_t key = ~std::uint64_t{0};
  std::uint32_t piece = kNoIndex;

  TANDEM_HD void take(std::uint64_t of, std::uint32_t at) {
    if (of < key) key = of, piece = at;
  }
};

/// Memory for the pieces of a pair of bodies: of `contacts` entries, or so many for each contact.
struct PieceMemory {
  /// Words that the table of keys takes for each contact; later on candidates lie there.
  static constexpr std::uint32_t kTableWords = 18;

  Piece* pieces;
  float* normals;        ///< 6 each: x, y, z of triangle a's unit normal, of b's
  std::uint32_t* curve;  ///< of each piece: another piece of its curve, in the end the first of them
  std::uint32_t* order;  ///< pieces, curve by curve
  std::uint32_t* start;  ///< of each curve in `order`; contacts + 1 entries
  std::uint32_t* table;  ///< kTableWords each

  // On a GPU, this is nearer memory, used for keys instead of `table` where it suffices.
  std::uint32_t* near_table = nullptr;
  std::uint32_t near_words = 0;

  /// Bytes for each contact, without the one entry more of `start`.
  static constexpr std::size_t kBytes = sizeof(Piece) + 24 + 12 + 4 * kTableWords;
};

TANDEM_HD inline std::uint64_t mixed(std::uint64_t x) {  // SplitMix64's finish
  x = (x ^ (x >> 30)) * 0xBF58476D1CE4E5B9u;
  x = (x ^ (x >> 27)) * 0x94D049BB133111EBu;
  return x ^ (x >> 31);
}

/// A name for an edge of a body: that of its two vertices.
TANDEM_HD inline std::uint64_t edge_key(const TriangleTopology& t, int k) {
  const std::uint32_t u = t.vertex[k], v = t.vertex[k == 2 ? 0 : k + 1];
  return u < v ? std::uint64_t{u} << 32 | v : std::uint64_t{v} << 32 | u;
}

/// Computes once more what the triangles of a piece have in common. Condition: it is a polygon.
TANDEM_HD_CALLED inline void meet_again(const BodyPair& bodies, const Piece& piece, Meeting& out) {
  meeting::meet_in_plane(bodies.a.triangle(piece.triangle[0]), bodies.b.triangle(piece.triangle[1]),
                         bodies.tolerance(), out);
}

/// The facts about all pieces together.
struct PieceSummary {
  std::uint32_t pieces = 0, segments = 0, curves = 0;
  bool degenerate =
      false;        ///< corners of one body lie in triangles of the other, or ends have no one partner
  Vector3 origin;   ///< the middle of all ends
  double unit = 1;  ///< a power of two, at least their distance from it along each axis
};

/// Says how many pieces there are, and where.
struct PieceBounds {
  std::uint32_t pieces = 0, segments = 0;
  bool degenerate = false;
  double lower[3] = {INFINITY, INFINITY, INFINITY}, upper[3] = {-INFINITY, -INFINITY, -INFINITY};

  TANDEM_HD void add(const Vector3& p) {
    const double x[3] = {p.x, p.y, p.z};
    for (int k = 0; k < 3; ++k) {
      lower[k] = lesser(lower[k], x[k]);
      upper[k] = greater(upper[k], x[k]);
    }
  }
  /// But for the count.
  TANDEM_HD void add(const Meeting& meeting) {
    degenerate = degenerate || meeting.degenerate;
    segments += meeting.kind == MeetingKind::segment ? 1u : 0u;
    add(meeting.end[0]);
    if (meeting.kind == MeetingKind::segment) add(meeting.end[1]);
    for (int i = 0; i < meeting.corners; ++i) add(meeting.corner[i]);
  }
};

/// Writes down what the triangles of a contact have in common. Condition: they have something in common.
TANDEM_HD inline void write_piece(const PieceMemory& memory, std::uint32_t at, const Contact& contact,
                                  const Vector3& normal_a, const Vector3& normal_b, const Meeting& meeting) {
  Piece& piece = memory.pieces[at];
  piece.triangle[0] = contact.triangle_a, piece.triangle[1] = contact.triangle_b;
  piece.info = static_cast<std::uint32_t>(meeting.kind) | (meeting.facing ? Piece::kFacing : 0u) |
               meeting.parted * Piece::kParted | (meeting.degenerate ? Piece::kDegenerate : 0u) |
               bits_of(meeting.feature[0]) << 8 | bits_of(meeting.feature[1]) << 12;
  piece.joined = 0;
  piece.end[0] = meeting.end[0];
  piece.end[1] = meeting.end[1];
  if (meeting.kind == MeetingKind::polygon)
    piece.end[1] = meeting.facing ? (meeting.area / 2) * normal_a : Vector3{};
  float* normals = memory.normals + 6 * std::size_t{at};
  const Vector3 both[2] = {normal_a, normal_b};
  for (int side = 0; side < 2; ++side) {
    normals[3 * side] = static_cast<float>(both[side].x);
    normals[3 * side + 1] = static_cast<float>(both[side].y);
    normals[3 * side + 2] = static_cast<float>(both[side].z);
  }
}

/// Finds the curves of one pair of bodies.
template <typename Team>
class CurveFinder {
 public:
  TANDEM_HD CurveFinder(const Team& team, const BodyPair& bodies, const PieceMemory& memory)
      : team_(team), bodies_(bodies), memory_(memory), table_(memory.table) {}

  /// Afterwards the pieces of curve c are order[start[c]] to order[start[c + 1] - 1]. next: a number that all
  /// of the team see, for its use. Condition: a team of one.
  TANDEM_HD PieceSummary find(const Contact* contacts, std::uint32_t count, std::uint32_t& next);

  /// Finds the curves of pieces that are written down already, from what all of them amount to.
  TANDEM_HD PieceSummary find_among(const PieceBounds& all, std::uint32_t& next);

 private:
  struct EndKey {
    std::uint64_t edge;
    std::uint32_t triangle;  // of the other body
    std::uint32_t side;
    TANDEM_HD bool operator==(const EndKey& k) const {
      return edge == k.edge && triangle == k.triangle && side == k.side;
    }
    TANDEM_HD std::uint64_t hash() const { return mixed(edge ^ mixed(std::uint64_t{triangle} << 1 | side)); }
  };
  struct CornerKey {
    std::uint32_t u, v;
    TANDEM_HD bool operator==(const CornerKey& k) const { return u == k.u && v == k.v; }
    TANDEM_HD std::uint64_t hash() const { return mixed((std::uint64_t{u} << 32 | v) + 0x9E3779B97F4A7C15u); }
  };

  TANDEM_HD const TriangleTopology& topology(int side, std::uint32_t triangle) const {
    return bodies_[side].shape->topology[triangle];
  }
  TANDEM_HD EndKey end_key(std::uint32_t reference) const {
    const Piece& piece = memory_.pieces[reference >> 4];
    const TriangleFeature f = piece.feature(static_cast<int>(reference & 1u));
    const int side = f.of_b != 0 ? 1 : 0;
    return {edge_key(topology(side, piece.triangle[side]), f.number), piece.triangle[1 - side], f.of_b};
  }
  TANDEM_HD CornerKey corner_key(std::uint32_t reference) const {
    const Piece& piece = memory_.pieces[reference >> 4];
    const std::uint32_t both = reference & 15u;
    return {topology(0, piece.triangle[0]).vertex[both / 3], topology(1, piece.triangle[1]).vertex[both % 3]};
  }

  /// The reference that was there first under the same key, or `reference` itself.
  template <typename KeyOf>
  TANDEM_HD std::uint32_t insert(std::uint32_t reference, std::uint32_t size, const KeyOf& key_of) {
    const auto key = key_of(reference);
    auto slot = static_cast<std::uint32_t>((key.hash() >> 32) * size >> 32);
    for (;;) {
      std::uint32_t there = team_.concurrent_load(table_[slot]);
      if (there == kNoIndex) there = team_.compare_and_swap(table_[slot], kNoIndex, reference);
      if (there == kNoIndex) return reference;
      if (key_of(there) == key) return there;
      if (++slot == size) slot = 0;
    }
  }

  TANDEM_HD std::uint32_t first_of(std::uint32_t piece) {
    for (;;) {
      const std::uint32_t next = team_.concurrent_load(memory_.curve[piece]);
      if (next == piece) return piece;
      // Halves the way for those who come later: a piece that is not the first of its set only ever names
      // others of the set, nearer to the first.
      const std::uint32_t after = team_.concurrent_load(memory_.curve[next]);
      if (after != next) team_.concurrent_store(memory_.curve[piece], after);
      piece = next;
    }
  }
  TANDEM_HD void join(std::uint32_t i, std::uint32_t j) {
    for (;;) {
      i = first_of(i), j = first_of(j);
      if (i == j) return;
      if (i < j) {
        const std::uint32_t k = i;
        i = j, j = k;
      }
      if (team_.compare_and_swap(memory_.curve[i], i, j) == i) return;
    }
  }

  TANDEM_HD void clear(std::uint32_t words) {
    table_ = words <= memory_.near_words ? memory_.near_table : memory_.table;
    for (std::uint32_t i = team_.rank(); i < words; i += team_.size()) table_[i] = kNoIndex;
    for (std::uint32_t i = team_.rank(); i < summary_.pieces; i += team_.size()) memory_.curve[i] = i;
    team_.sync();
  }
  TANDEM_HD PieceBounds make_pieces(const Contact* contacts, std::uint32_t count);
  TANDEM_HD void summarize(const PieceBounds& all);
  TANDEM_HD bool connect_by_ends();
  TANDEM_HD_CALLED void connect_by_corners();
  TANDEM_HD void sort_by_curve(std::uint32_t& next);

  const Team& team_;
  const BodyPair& bodies_;
  PieceMemory memory_;
  PieceSummary summary_;
  std::uint32_t* table_;
};

/// Writes down what the contacts have in common.
template <typename Team>
TANDEM_HD PieceBounds CurveFinder<Team>::make_pieces(const Contact* contacts, std::uint32_t count) {
  PieceBounds found;
  const double tolerance = bodies_.tolerance();
  Meeting meeting;
  WorldTriangle a, b;
  std::uint32_t posed_a = kNoIndex, posed_b = kNoIndex;
  for (std::uint32_t i = 0; i < count; ++i) {
    const Contact& contact = contacts[i];
    if (contact.triangle_a != posed_a) a = bodies_.a.triangle(posed_a = contact.triangle_a);
    if (contact.triangle_b != posed_b) b = bodies_.b.triangle(posed_b = contact.triangle_b);
    meet(a, b, tolerance, meeting);
    if (meeting.kind == MeetingKind::none) continue;
    write_piece(memory_, found.pieces++, contact, a.normal, b.normal, meeting);
    found.add(meeting);
  }
  return found;
}

template <typename Team>
TANDEM_HD void CurveFinder<Team>::summarize(const PieceBounds& all) {
  summary_ = {};
  summary_.pieces = all.pieces;
  summary_.segments = all.segments;
  summary_.degenerate = all.degenerate;
  double extent = 0, middle[3];
  for (int k = 0; k < 3; ++k) {
    // Zeros of either sign may be the outermost; their middle is to be 0 for all teams.
    middle[k] = (0.5 * all.upper[k] + 0.5 * all.lower[k]) + 0.0;
    extent = greater(extent, all.upper[k] - all.lower[k]);
  }
  summary_.origin = {middle[0], middle[1], middle[2]};
  // Powers of two, so that scaling by them is exact.
  int exponent = 0;
  if (extent > 0) std::frexp(extent, &exponent);
  summary_.unit = std::ldexp(1.0, exponent);
}

/// Ends are known by the edge and the triangle that meet there: every edge inside a surface has two
/// triangles, so two pieces share the end. False where one is alone for another reason than an open surface's
/// boundary: rounding chose another feature there, or a triangle pair is missing.
template <typename Team>
TANDEM_HD bool CurveFinder<Team>::connect_by_ends() {
  if constexpr (HasLanes<Team>) return team_.lanes().connect_by_ends(bodies_, memory_, summary_.pieces);
  const std::uint32_t size = 4 * summary_.pieces;
  clear(size);
  int alone = 0;
  bool many = false;
  for (std::uint32_t i = team_.rank(); i < summary_.pieces; i += team_.size()) {
    const Piece& piece = memory_.pieces[i];
    for (std::uint32_t end = 0; end < 2; ++end) {
      const TriangleFeature f = piece.feature(static_cast<int>(end));
      const std::uint32_t flags = topology(f.of_b, piece.triangle[f.of_b]).flags;
      many = many || has_many_triangles(flags, f.number);
      const std::uint32_t reference = i << 4 | end;
      const std::uint32_t first = insert(reference, size, [&](std::uint32_t of) { return end_key(of); });
      if (!is_boundary(flags, f.number)) alone += first == reference ? 1 : -1;
      if (first != reference) join(first >> 4, i);
    }
  }
  team_.sync();
  return team_.sum(alone) == 0 && !team_.any(many);
}

/// If corners lie in planes, the ends are ambiguous: then pieces hang together whose triangles share a corner
/// on both sides.
template <typename Team>
TANDEM_HD_CALLED void CurveFinder<Team>::connect_by_corners() {
  if constexpr (HasLanes<Team>) return team_.lanes().connect_by_corners(bodies_, memory_, summary_.pieces);
  const std::uint32_t size = PieceMemory::kTableWords * summary_.pieces;
  clear(size);
  for (std::uint32_t i = team_.rank(); i < summary_.pieces; i += team_.size()) {
    for (std::uint32_t both = 0; both < 9; ++both) {
      const std::uint32_t first =
          insert(i << 4 | both, size, [&](std::uint32_t of) { return corner_key(of); });
      join(first >> 4, i);
    }
  }
  team_.sync();
}

template <typename Team>
TANDEM_HD void CurveFinder<Team>::sort_by_curve(std::uint32_t& next) {
  const std::uint32_t pieces = summary_.pieces;
  std::uint32_t firsts = 0;
  for (std::uint32_t i = team_.rank(); i < pieces; i += team_.size())
    firsts += team_.load(memory_.curve[i]) == i;
  summary_.curves = team_.sum(firsts);
  if (summary_.curves <= 1) {
    for (std::uint32_t i = team_.rank(); i < pieces; i += team_.size()) memory_.order[i] = i;
    if (team_.rank() == 0) memory_.start[0] = 0, memory_.start[1] = pieces;
    team_.sync();
    return;
  }
  // The table has the number of each curve by its first piece; for each piece the first of its curve; where
  // the curves begin.
  static_assert(PieceMemory::kTableWords >= 4);
  std::uint32_t *number = table_, *first = table_ + pieces, *begin = table_ + 2 * std::size_t{pieces};
  if (team_.rank() == 0) team_.store(next, 0);
  for (std::uint32_t i = team_.rank(); i <= summary_.curves; i += team_.size()) begin[i] = 0;
  for (std::uint32_t i = team_.rank(); i < pieces; i += team_.size()) first[i] = first_of(i);
  team_.sync();
  for (std::uint32_t i = team_.rank(); i < pieces; i += team_.size()) {
    if (first[i] == i) number[i] = team_.add(next, 1);
  }
  team_.sync();
  for (std::uint32_t i = team_.rank(); i < pieces; i += team_.size())
    team_.add(begin[number[first[i]] + 1], 1);
  team_.sync();
  if (team_.rank() == 0) {
    for (std::uint32_t c = 0; c < summary_.curves; ++c) begin[c + 1] += begin[c];
  }
  team_.sync();
  for (std::uint32_t c = team_.rank(); c <= summary_.curves; c += team_.size()) memory_.start[c] = begin[c];
  team_.sync();
  for (std::uint32_t i = team_.rank(); i < pieces; i += team_.size())
    memory_.order[team_.add(begin[number[first[i]]], 1)] = i;
  team_.sync();
}

template <typename Team>
TANDEM_HD PieceSummary CurveFinder<Team>::find(const Contact* contacts, std::uint32_t count,
                                               std::uint32_t& next) {
  if constexpr (HasLanes<Team>)
    return find_among(team_.lanes().make_pieces(bodies_, memory_, contacts, count), next);
  return find_among(make_pieces(contacts, count), next);
}

template <typename Team>
TANDEM_HD PieceSummary CurveFinder<Team>::find_among(const PieceBounds& all, std::uint32_t& next) {
  summarize(all);
  if (summary_.pieces == 0) return summary_;
  if (summary_.degenerate || !connect_by_ends()) {
    summary_.degenerate = true;
    connect_by_corners();
  }
  sort_by_curve(next);
  return summary_;
}

}  // namespace tandem::manifold
