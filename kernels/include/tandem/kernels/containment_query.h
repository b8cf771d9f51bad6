#pragma once
#include <cstdint>
#include <span>

#include "tandem/kernels/contact_query.h"

namespace tandem {

enum ContainmentFlags : std::uint32_t {
  /// An odd number of the outer body's closed surfaces is around the component. A surface in a cavity's place
  /// counts too: what lies in the hollow of a shell has two around it, and is not inside.
  kInside = 1,
  /// The outer body has components that are not closed; of these, there is no inside.
  kOuterOpen = 2,
};

/// A component of a body that meets nothing of another body, and lies within it.
struct Containment {
  std::uint32_t pair;       ///< row of the list of object pairs
  std::uint32_t inner;      ///< whose component it is: 0: a's, which lies in b; 1: b's, which lies in a
  std::uint32_t component;  ///< of the inner body: LevelView::components[component]
  std::uint32_t flags;      ///< ContainmentFlags, at least one

  friend bool operator==(const Containment&, const Containment&) = default;
};

struct ContainmentCounters {
  std::uint64_t object_pairs = 0;
  std::uint64_t inside = 0, outer_open = 0;  ///< rows with these flags

  friend bool operator==(const ContainmentCounters&, const ContainmentCounters&) = default;
};

/// Finds what lies within another body of an object pair without touching it, which no contact tells. Decides
/// exactly, on the posed vertices. Rows come by ascending pair, inner body and component.
class ContainmentQuery : public Answer<Containment, ContainmentCounters> {
 public:
  /// Finds the components of either body of each pair that have no contact with the other body, and have the
  /// flag kInside; or, where the other body has components that are not closed, lie in its world box: their
  /// first vertex does. A pair of an instance with itself has none. contacts: all of these pairs in the scene
  /// as it stands, in mode exact and by ascending pair, as ContactQuery has them; where no body has two
  /// components, the first contact of each pair will do. Result: kOk; kNoTopology, where where() of the scene
  /// is an asset whose file has none; kUnknownInstance, where it is the pair; kUnknownContact, where it is
  /// the contact: it names a pair or a triangle that does not exist, or comes behind one of a later pair;
  /// kTooManyPairs, kOutOfMemory or kCannotStartThread.
  Status find(Scene& scene, std::span<const ObjectPair> pairs, std::span<const Contact> contacts);

  /// Asks about the contacts that a question found, where the scene's device has them on the device.
  Status find(Scene& scene, const ContactQuery& contacts);

 private:
  struct State;
  Status ask(Scene& scene, std::span<const ObjectPair> pairs, std::span<const Contact> contacts,
             const ContactQuery* query);
  Status answer(SceneState& scene, std::span<const Contact> contacts);

  Kept<State> state_;
};

}  // namespace tandem
