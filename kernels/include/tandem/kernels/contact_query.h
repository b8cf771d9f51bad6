#pragma once
#include <cstdint>
#include <span>

#include "tandem/kernels/detail/question.h"

namespace tandem {

/// Says what a query decides on.
enum class QueryMode : std::uint8_t {
  exact,  ///< contact pairs, as exact arithmetic on the posed vertices finds them
  fast,   ///< contact pairs by float32 in the first instance's frame, which may err where rounding does
  boxes,  ///< candidates: triangles whose boxes overlap; all that touch are among them, and many that do not
};

/// Two triangles that meet: triangle_a belongs to instance pairs()[pair].a, triangle_b to pairs()[pair].b.
/// In a pair of an instance with itself either of them may be a.
struct Contact {
  std::uint32_t pair;
  std::uint32_t triangle_a, triangle_b;  ///< in leaf order: LevelView::triangles[triangle_a]
  std::uint32_t face_a, face_b;          ///< the faces of the source files that they come from

  friend bool operator==(const Contact&, const Contact&) = default;
};

/// The most rings of neighbours that contacts of an instance with itself can leave out.
inline constexpr std::uint32_t kMostRings = 8;

struct ContactOptions {
  QueryMode mode = QueryMode::exact;
  bool first_contact_only = false;  ///< the query reports one contact for each object pair that touches
  bool self_pairs = false;          ///< where the scene finds the pairs: also each instance with itself
  /// Clearance: triangles whose distance is at most this count as contacts, decided exactly, in mode fast
  /// too; candidates are triangles whose boxes are within it. 0: those that meet. From 0 to
  /// kLargestWorldCoordinate, else kBadReach.
  double within = 0;
  /// Levels of detail: each object pair is asked for a clearance that is larger by what its two levels may
  /// differ from the finest ones (docs/levels.md). The finest surfaces of a pair without a contact, and of
  /// two instances that are not found as a pair, are then surely farther apart than `within`, or with 0 do
  /// not meet. Mode fast decides exactly then, too. Pairs of finest levels, and pairs of an instance with
  /// itself, are decided as without.
  bool add_error_bounds = false;
  /// Pairs of an instance with itself: the rings of neighbours that are left out. 0: none. 1: pairs of
  /// triangles that share a vertex. n: pairs of which a path of at most n - 1 edges leads from a vertex of
  /// one triangle to a vertex of the other. Vertices are those of the topology: different ones at one place
  /// are no neighbours. All modes, `within` and first_contact_only take what is left. At most kMostRings,
  /// else kBadOption. From 2 on, lists of vertices are made when an asset is first asked about and kept until
  /// the scene gets other assets, or another number is asked for: a regular mesh of v vertices takes about 6
  /// v n (n - 1) bytes, and one with a vertex of d edges 2 d^2 bytes where n > 2.
  std::uint32_t leave_out_rings = 0;
};

/// Counts what a query did. The counters depend neither on the number of threads nor on the machine.
struct ContactCounters {
  std::uint64_t object_pairs = 0;
  std::uint64_t block_pairs = 0;  ///< 16 box tests each
  /// Neighbours that are left out do not count, nor, except in boxes mode, do triangles that planes of leaves
  /// tell apart.
  std::uint64_t candidates = 0;
  std::uint64_t decided_by_float32 = 0;  ///< candidates, by the stage of the cascade that decided
  std::uint64_t decided_by_float64 = 0;
  std::uint64_t decided_exactly = 0;
  std::uint64_t contacts = 0;

  friend bool operator==(const ContactCounters&, const ContactCounters&) = default;
};

/// Finds every pair of triangles that meet. Rows are contacts by ascending pair; within a pair they come in
/// an order that is the same on every run and machine. find() takes about 100 KB of the calling thread's
/// stack. Result of find(): kOk; kBadReach (see ContactOptions::within); kBadOption (see
/// ContactOptions::leave_out_rings); kNoTopology, where neighbours are to be left out and where() of the
/// scene is the asset that has none; kUnknownInstance, where where() is the given pair; kTooManyPairs;
/// kCannotStartThread; or kOutOfMemory, also where the machine, or the limit of the process's control group,
/// has not enough memory available for the contacts: Linux would grant it and kill the process later.
///
/// A given pair of an instance with itself asks for the contacts within it: each pair of two different
/// triangles once, neighbours in the mesh included, which touch, unless ContactOptions::leave_out_rings
/// leaves them out.
class ContactQuery : public PairQuestion<ContactQuery, Contact, ContactCounters, ContactOptions> {
 private:
  friend PairQuestion;
  struct State;
  Status answer(SceneState& scene, const std::span<const ObjectPair>* given, const ContactOptions& options);

  Kept<State> state_;
};

}  // namespace tandem
