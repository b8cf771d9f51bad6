#pragma once
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "dynamics/remembered_contacts.h"
#include "dynamics/threads.h"
#include "tandem/kernels/object_pair.h"

namespace tandem::dynamics {

/// Remembers the contacts of a step and their impulses. Pairs that have not moved keep their contacts:
/// contacts of meshes change with every triangle that comes or goes, and found anew in each step they would
/// shake what rests. The others start from the impulses of the step before.
class ContactCache {
 public:
  /// Returns the pairs whose contacts are remembered, ascending.
  std::vector<ObjectPair> pairs() const;

  /// Makes the contacts of a step. Pairs that are kept have those remembered, moved with the bodies; these
  /// may have become gaps, and are left out while the step will not close them. All others have those found,
  /// and those just lost: remembered ones that are gaps along the normal of at most the pair's `fall()`, slid
  /// by at most a fiftieth of the smaller body's radius, with no other contact of the pair that near, for at
  /// most eight steps since they pushed. Without these a body that comes off by a hair falls freely for a
  /// whole step, and deeper than it was.
  ///
  /// These contacts start with the impulse of the remembered one of the pair that has the same feature, or
  /// else of the nearest one within a tenth of the smaller body's radius; each is given once. What then is
  /// left of a pair's normal impulse and of what resists turning is shared out among its contacts that got
  /// none, so that a pair pushes as it did although its points have changed.
  ///
  /// Pairs of two idle bodies stay remembered and are left out. Conditions: found comes by ascending pair;
  /// kept is ascending.
  void update(std::span<const ContactPoint> found, std::span<const ObjectPair> kept, const BodiesAhead& of,
              Threads& threads);

  /// Does what update() does, of what was remembered when it was last called.
  void update_again(std::span<const ContactPoint> found, std::span<const ObjectPair> kept,
                    const BodiesAhead& of, Threads& threads);

  /// Returns the contacts of the step that update() was last called for, by ascending pair.
  std::span<const ContactPoint> contacts() const { return made_.contacts; }

  /// Returns whether no contact had been remembered before.
  bool is_cold() const { return is_cold_; }

  /// Returns the impulses that the contacts start with.
  std::vector<ContactImpulse> impulses() const;

  /// Takes what the contacts did. Condition: one for each.
  void remember(std::span<const ContactImpulse> impulses);

  std::span<const CachedContact> entries() const { return made_.entries; }

  /// Remembers these contacts instead. contacts() are none until the next update().
  void restore(std::vector<CachedContact> entries);

 private:
  /// What update() makes of the contacts of some pairs.
  struct Made {
    std::vector<CachedContact> entries;  // by ascending pair
    std::vector<ContactPoint> contacts;
    std::vector<std::uint32_t> place;  // of each contact in entries
    std::vector<std::uint8_t> marks;   // for one pair

    void make(std::span<const CachedContact> rest, std::span<const ContactPoint> found,
              std::span<const ObjectPair> kept, const BodiesAhead& of);
    // Makes room behind what there is, and takes what `make` says that it made there of a pair's contacts.
    template <typename Make>
    void add(std::size_t room, const Make& make);
    void resize(std::size_t entry_count, std::size_t contact_count);
  };
  void join_parts(Threads& threads);

  Made made_;
  std::vector<Made> parts_;
  std::vector<CachedContact> before_;  // the entries until update()
  bool is_cold_ = true;
};

}  // namespace tandem::dynamics
