#pragma once
#include <cstdint>
#include <span>

#include "tandem/kernels/contact_query.h"
#include "tandem/kernels/manifold.h"
#include "tandem/kernels/moved_query.h"

namespace tandem {

struct ManifoldOptions {
  /// Points are looked for among those of the last call: Manifold points then have `previous`, and keep the
  /// ids that they had. Without it ids are those of the features, and the last call does not matter.
  bool match_previous = true;
  std::uint32_t most_points =
      kMostManifoldPoints;  ///< of a manifold, from 1 to kMostManifoldPoints, else kBadOption
  /// If an overlap of bodies that are not convex is deep, lines around the deepest one found are not looked
  /// at. This takes less time, but more depths are too small (docs/contacts.md).
  bool quick_depths = false;
};

/// Makes contact manifolds of contacts. Rows are manifolds by ascending pair and, within a pair, by their
/// least pair of triangles.
class ManifoldQuery : public Answer<Manifold, ManifoldCounters> {
 public:
  /// Makes the manifolds of contacts between these pairs of a scene as it stands. A pair of an instance with
  /// itself has none. The result does not depend on the order of the contacts. Result: kOk; kNoTopology,
  /// where where() of the scene is an asset whose file has none; kOutOfRange, where it is an instance that
  /// reaches too far; kUnknownInstance, where it is the pair; kUnknownContact, where it is the contact: it
  /// names a pair or a triangle that does not exist; kTooManyPairs, kOutOfMemory or kCannotStartThread; and
  /// kOutOfRange where there are too many contacts, 2^29 or 2^27 of a pair, or points. After an error the
  /// next call finds no points before it.
  Status find(Scene& scene, std::span<const ObjectPair> pairs, std::span<const Contact> contacts,
              const ManifoldOptions& options = {});

  /// Makes the manifolds of the contacts that a question found, where the scene's device has them on the
  /// device.
  Status find(Scene& scene, const ContactQuery& contacts, const ManifoldOptions& options = {});

  /// Makes the manifolds of the contacts of the pairs that have moved, and puts those of the pairs that are
  /// kept between them: rows and pairs() are about moved.pairs(). `contacts` are those of moved.rows(), and
  /// name these.
  ///
  /// A kept manifold is that of the pose where it was found, moved with the bodies: normal and area_vector
  /// turn with the larger body, in_a and in_b stay, position and centre go the mean way of the two bodies,
  /// and depths are measured anew between in_a and in_b, less than 0 where the bodies have come apart. Flags,
  /// ids and the number and order of points stay. Where neither body has moved, all bytes but indices do. A
  /// kept pair without manifolds still has none.
  ///
  /// Result: as above, where where() counts rows of `moved`; also kKeptMismatch: the scene does not stand as
  /// it did for `moved`, the contacts are not of its rows, or pairs are kept whose manifolds the call before
  /// did not return, because it was not about moved.call_before().
  Status find(Scene& scene, const MovedQuery& moved, const ContactQuery& contacts,
              const ManifoldOptions& options = {});
  Status find(Scene& scene, const MovedQuery& moved, std::span<const Contact> contacts,
              const ManifoldOptions& options = {});

  /// The points of the manifolds, manifold by manifold. Valid as the rows.
  std::span<const ManifoldPoint> points() const { return points_.view(); }

  /// The next call finds no points before it.
  void forget_points();

 private:
  /// What is asked: contacts of pairs, and the questions that found them, or null.
  struct Asked {
    std::span<const ObjectPair> pairs;
    std::span<const Contact> contacts;
    const ContactQuery* query;
    const MovedQuery* moved;
  };
  struct State;
  Status ask(Scene& scene, const Asked& asked, const ManifoldOptions& options);
  Status answer(SceneState& scene, State& state, const Asked& asked, const ManifoldOptions& options);

  Kept<State> state_;
  Buffer<ManifoldPoint> points_;
};

}  // namespace tandem
