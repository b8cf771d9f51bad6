#pragma once
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "dynamics/contact_point.h"
#include "tandem/kernels/contact_query.h"
#include "tandem/kernels/manifold_query.h"
#include "tandem/kernels/moved_query.h"

namespace tandem::dynamics {

/// A question about the scene failed, or its bodies are not such as it can be asked about.
struct QueryFailed {
  Status status;
  std::uint64_t where;  ///< the body or pair to blame, as of Scene::where()
};

/// Throws QueryFailed, or std::bad_alloc, unless the status is kOk.
void require(Status status, const Scene& scene);

/// Counts what became of pairs of triangles.
struct ContactStatistics {
  ManifoldCounters counters;
  double area = 0;   ///< of all manifolds, seen along their normals
  double depth = 0;  ///< the largest
};

/// The points of manifolds, by ascending pair of bodies. pairs: those that the manifolds name.
void take_points(const ManifoldQuery& manifolds, std::span<const ObjectPair> pairs,
                 std::vector<ContactPoint>& points, ContactStatistics& statistics);

/// Seconds that it took to find contacts.
struct DetectionTimes {
  double update = 0;          ///< following the bodies
  double broad_phase = 0;     ///< pairs of bodies
  double traversal = 0;       ///< with the triangle tests where these are not told apart
  double triangle_tests = 0;  ///< 0 where they are part of traversal
  double transfer = 0;        ///< bringing the answer to the CPU, and sorting it
  double generation = 0;      ///< making points of triangle pairs
};

/// Says how contacts were found.
struct FinderReport {
  DetectionTimes times;
  ContactCounters counters;
  ContactStatistics contacts;
  std::uint64_t kept_pairs = 0;
};

/// Says which pairs keep the contacts that they have.
struct Keeping {
  std::span<const ObjectPair> remembered;  ///< of which the caller remembers what was found, ascending
  double tolerance;  ///< a pair keeps that until it has moved by more than this, see MovedQuery
  std::optional<std::span<const ObjectPair>> near = {};  ///< all others that may touch, ascending, where the
                                                         ///< caller knows; else those whose boxes meet, and
                                                         ///< they too are kept
};

/// Returns the filter, or one that excludes nothing where it is null, with these motions.
inline PairFilter with_motions(const PairFilter* filter, const std::vector<Motion>& motion) {
  PairFilter with = filter != nullptr ? *filter : PairFilter{};
  with.motion = motion.data();
  return with;
}

/// A simulation has its contacts from one of these.
class ContactFinder {
 public:
  virtual ~ContactFinder() = default;

  /// The contacts of bodies that stand like this, by ascending pair of bodies; those of kept() are left out,
  /// and those of two idle bodies may be. Valid until the next call. Condition: idle is empty or has an entry
  /// for each body. Throws QueryFailed, or what an engine throws.
  virtual const std::vector<ContactPoint>& find(std::span<const Instance> bodies,
                                                std::span<const std::uint8_t> idle,
                                                const Keeping& keeping) = 0;

  /// Returns the pairs of the last call that keep what was found of them, ascending.
  std::span<const ObjectPair> kept() const { return kept_; }

  /// Return what the next call takes the motion of pairs from, and let it go on from there.
  virtual std::span<const PosedBodies> posed() const = 0;
  virtual void resume(std::span<const PosedBodies> posed) = 0;

  /// Returns the report of the last call.
  const FinderReport& report() const { return report_; }

 protected:
  /// Finds the pairs to ask about; kept_ becomes those that keep what was found. meeting: pairs whose boxes
  /// meet, looked at where the caller does not know what is near.
  std::span<const ObjectPair> find_moved(Scene& scene, MovedQuery& moved, std::span<const ObjectPair> meeting,
                                         const Keeping& keeping);

  FinderReport report_;
  std::vector<ObjectPair> kept_;

 private:
  std::vector<ObjectPair> pairs_, asked_;
};

}  // namespace tandem::dynamics
