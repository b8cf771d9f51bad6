#pragma once
#include <cstdint>

#include "kernels/manifold/contact_curves.h"
#include "kernels/manifold/deepest_line.h"
#include "tandem/kernels/manifold.h"

/// The steps from a curve of pieces to a manifold pass this data on to each other.
namespace tandem::manifold {

/// A manifold before it has its place.
struct Patch {
  Manifold manifold;
  std::uint64_t key;  ///< of its least piece: the order within a pair
  ManifoldPoint point[kMostManifoldPoints];
};

/// The area vector of a region of several curves, or of one whose parts cancel, has a direction if it is more
/// than this part of the square of the curves' length.
inline constexpr double kLeastArea = 1e-6;

/// Sums over the pieces of a curve.
struct CurveSums {
  ExactVectorSum area, gap, middle;
  ExactSum length;
  LeastPiece least;

  TANDEM_HD void add(const PieceMemory& memory, std::uint32_t at, const Vector3& origin, double one_by_unit) {
    const Piece& piece = memory.pieces[at];
    least.take(piece.key(), at);
    if (piece.kind() == MeetingKind::polygon) return area.add(piece.end[1], one_by_unit * one_by_unit);
    const Vector3 from = piece.end[0] - origin, along = piece.weight() * (piece.end[1] - piece.end[0]);
    area.add(0.5 * cross(from, along), one_by_unit * one_by_unit);
    gap.add(along, one_by_unit);
    const double size = norm(along);
    length.add(size, one_by_unit);
    middle.add((size * one_by_unit) * (0.5 * (from + (piece.end[1] - origin))), one_by_unit);
  }
};

/// The sums over all pieces of a curve.
struct CurveMeasure {
  Vector3 area;    ///< half the sum of r x dr, and polygons: from a towards b
  Vector3 middle;  ///< of the pieces
  double length = 0;
  bool point = false;  ///< all pieces are points, as nearly as it can be told: the ends of one may differ
  bool closed = true;
  bool by_area = true;   ///< the area says where the normal is: the curve is closed, and not so small that
                         ///< rounding of its points decides
  Vector3 sheet_normal;  ///< of the pieces' triangles, from a towards b, times lengths, where the area does
                         ///< not say it; of open surfaces where there are any
  std::uint64_t key = 0;

  /// The unit vector along which the area, or what stands for it, says that the patch pushes; 0 where parts
  /// of the curve cancel each other, so that rounding is left.
  TANDEM_HD Vector3 push() const {
    const Vector3& own = by_area ? area : sheet_normal;
    const double size = norm(own);
    return size > kLeastArea * length * (by_area ? length : 1.0) ? (1 / size) * own : Vector3{};
  }
};

/// Unit normals of float32 whose difference's square is less are of one face: half a milliradian.
inline constexpr float kSameFace = 2e-7f;

/// The face that lies most across a direction; of several that of the least piece.
struct FaceAlong {
  float along = 0.9f;  ///< faces that lie less across it do not count
  LeastPiece least;

  TANDEM_HD void take(float of_piece, std::uint64_t key, std::uint32_t piece) {
    if (of_piece > along) along = of_piece, least = {};
    if (of_piece == along) least.take(key, piece);
  }
};

/// The heights of a patch's triangles along a direction.
struct Spread {
  double highest_a, lowest_b;
};

/// A direction is better than another only if the overlap along it is less by more than this part.
inline constexpr double kShallower = 1e-9;

/// The most directions that are tried for a normal.
inline constexpr int kMostTried = 13;

/// The direction of a face, from a towards b.
struct Direction {
  Vector3 n;
  std::uint32_t piece;  ///< one whose triangle has it
};

/// The memory that a team shares while it looks for a normal.
struct NormalMemory {
  Direction direction[kMostTried];  ///< of faces of a, then of b
  Vector3 tried[kMostTried];
  int count;       ///< of those tried, where that is not known to all
  bool both_ways;  ///< of a deep patch: they are tried the other way as well
  Spread spread[kMostTried];
};

/// Says how a patch pushes.
enum class PatchKind : std::uint32_t {
  overlap,    ///< along a normal that its area or its faces give
  touch,      ///< the surfaces meet without area
  ambiguous,  ///< corners or edges that touch each other: no direction is better than another
  deep,       ///< the area gives no normal: the overlap is to be measured along all that come into question
};

/// The direction in which the bodies of a patch push each other.
struct PatchNormal {
  Vector3 n;  ///< unit, from a towards b
  PatchKind kind = PatchKind::ambiguous;
};

/// A point of a patch where its curve has a corner, as the search for the outermost ones sees it.
struct Candidate {
  float x, y;
  std::uint32_t reference;  ///< piece * 8 + number of its end or corner
};
static_assert(sizeof(Candidate) == 12);

struct FloatPoint {
  float x, y;
};

/// Candidates are rounded to float32. Ways between them that differ by less than this part of their largest
/// coordinate are equal but for that.
inline constexpr float kTiedOnRim = 0x1p-21f;

/// The value that a candidate is to have most of: distance from p, or distance beyond the line from p to q,
/// times its length.
struct RimValue {
  FloatPoint p, q;
  bool distance;

  /// Returns how much less than the greatest value, which is positive, one may be and equal to it but for
  /// rounding. unit: no coordinate is larger.
  TANDEM_HD float tied(float greatest, float unit) const {
    const float x = q.x - p.x, y = q.y - p.y;
    return lesser(kTiedOnRim * unit * std::sqrt(distance ? greatest : x * x + y * y), greatest / 2);
  }

  TANDEM_HD float operator()(const Candidate& c) const {
    const float x = c.x - p.x, y = c.y - p.y;
    return distance ? x * x + y * y : (q.y - p.y) * x - (q.x - p.x) * y;
  }
};

/// The candidate that has most of something: of those whose values are equal but for rounding, the one whose
/// triangles come first.
struct Furthest {
  float value;  ///< the greatest; before one is found, what it has to be greater than
  std::uint32_t reference;

  TANDEM_HD static std::uint64_t key(const PieceMemory& memory, std::uint32_t reference) {
    const Piece& p = memory.pieces[reference / 8];
    return std::uint64_t{p.triangle[0]} << 33 | std::uint64_t{p.triangle[1]} << 3 | (reference & 7u);
  }
  TANDEM_HD void take(const PieceMemory& memory, std::uint32_t of) {
    if (reference == kNoIndex || key(memory, of) < key(memory, reference)) reference = of;
  }
};

/// Twice the area within a curve as it is seen along the normal, and that times its middle.
struct RimMoments {
  ExactSum twice_area, x, y;
};

/// A patch's outermost candidates, counter-clockwise.
struct Rim {
  std::uint32_t reference[kMostManifoldPoints];
  FloatPoint at[kMostManifoldPoints];
  int rank[kMostManifoldPoints];  ///< how many were found before
  int points;
};

/// The memory that a team shares while it looks for a rim.
struct RimMemory {
  Rim rim;
  Furthest of_side[kMostManifoldPoints];  ///< beyond the side from point i to the next: what it would add
  int first, second;                      ///< sides that are to be looked beyond
  bool complete;
};

/// A point of the rim, and the line across the patch that measures the depth there.
struct Sounding {
  Vector2 at, line;         ///< the line runs a little further inside
  double height;            ///< of the point
  std::uint32_t reference;  ///< the candidate
  std::uint64_t feature;
  int rank;
  Crossing surface[2];  ///< a's, that faces along the normal; b's, that faces against it

  TANDEM_HD double overlap() const {
    return surface[0].found() && surface[1].found() ? surface[0].height - surface[1].height : 0;
  }
};

/// A point that a manifold may have, as those that it has are chosen.
struct Chosen {
  Vector2 at;
  double height, depth, from_middle;
  Vector3 normal;  ///< from a towards b
  Vector3 half;    ///< of a bent patch: from the point to a's surface
  std::uint64_t feature;
  std::uint32_t triangle[2];
  bool deepest;  ///< it lies on the deepest line
};

/// Two surfaces that face each other, as a line across the overlap meets them.
struct Sheet {
  Vector3 at;      ///< half-way between them
  Vector3 normal;  ///< half-way between their normals, from a towards b
  Vector3 half;    ///< from there to a's
  double depth;    ///< the way between them along the normal
  std::uint32_t triangle[2];
  bool found;
};

/// The most points of a rim: one is left for the deepest line, unless the surfaces only touch.
inline constexpr int kMostRimPoints = static_cast<int>(kMostManifoldPoints);

/// The most lines on which a bent patch is looked at: beside the points of the rim, and through the seeds.
inline constexpr int kMostSheets = kMostRimPoints - 1 + kMostSeeds;
static_assert(2 * kMostSheets <= LineMemory::kMost);

/// The most points of a rim between which ridges are looked for (patch_ridges.h): with more corners it takes
/// all points that a manifold may have.
inline constexpr int kMostRidged = 5;

/// The state of a patch from one step to the next.
struct PatchState {
  Sounding sounding[kMostRimPoints];
  OverlapLine ridge[kMostRidged];  ///< between a point of the rim and the next, where it is deep
  Sheet sheet[kMostSheets];        ///< of a bent patch
  OverlapLine deepest;             ///< none where the patch has no depth
  int rim_points, sheets;
  PatchKind kind;
  bool closed, goes_through;
  bool bent;      ///< a thin one whose surfaces turn from place to place
  bool through;   ///< of a bent one: the deepest line leaves the overlap on its way
  bool has_area;  ///< else the surfaces touch in points or along lines
  PatchFrame frame;
  Vector3 area;            ///< CurveMeasure's
  Vector3 centre;          ///< of the rim
  Vector2 middle;          ///< of the rim
  Vector2 middle_of_area;  ///< that of the rim where there is none
  double reach;            ///< of the rim, from its centre
  std::uint64_t key;
  std::uint32_t candidates;

  /// How many of `ridge` may be found.
  TANDEM_HD int ridges() const { return rim_points <= kMostRidged ? rim_points : 0; }
};

/// Where the overlap of a patch is to be measured: along its normal, or along many directions if it is deep.
struct DepthSearch {
  CurveMeasure measure;
  Vector3 middle;
  double reach;  ///< from the middle to the rim; of a deep patch, to all pieces
  int directions, places;
  bool both_ways;  ///< along each line that is tried
  double enough;   ///< no line along another direction needs to be deeper
  Vector3 tried[kMostTried];
  Seeds seeds;  ///< at first, places on the curve

  TANDEM_HD Vector3 along(int i) const {
    if (!both_ways) return tried[i];
    return i % 2 == 0 ? tried[i / 2] : -tried[i / 2];
  }
};

/// What a caller asks of patches; see ManifoldOptions.
struct PatchOptions {
  int most_points;
  bool quick_depths;
};

/// Returns how deep a line along any other direction is if it need not be looked at, as one was found.
TANDEM_HD inline double enough_for_others(const OverlapLine& line) {
  return line.found() ? line.depth() * (1 + 2 * kShallower) : INFINITY;
}

/// The deepest line along each direction of a deep patch; none where that is not known to be the shallowest.
struct DeepLines {
  OverlapLine along[2 * kMostTried];
};

/// The memory that a team shares while it finds a patch's normal and rim.
struct OutlineMemory {
  NormalMemory normal;
  RimMemory rim;
  std::uint32_t next;
};

/// The most points of which a manifold's are chosen.
inline constexpr int kMostCandidates = 2 * kMostRimPoints;
static_assert(kMostCandidates >= kMostRimPoints + 1 + kMostSeeds && kMostCandidates >= 2 * kMostRidged + 1);

/// The memory that a team shares while it chooses a patch's points.
struct ChoiceMemory {
  Chosen candidate[kMostCandidates], chosen[kMostCandidates];
  Patch* patch;
  std::uint32_t count;
};

}  // namespace tandem::manifold
