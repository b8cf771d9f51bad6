#pragma once
#include <span>
#include <vector>

#include "dynamics/bodies_ahead.h"
#include "dynamics/contact_finder.h"
#include "tandem/kernels/distance_query.h"

namespace tandem::dynamics {

/// Finds contacts of bodies that do not touch yet but may within the step, with their gaps, so that the
/// solver stops them where they meet, and not a step later and deep in each other.
///
/// The nearest points of a pair say from where its bodies may come together: b is moved this way until it
/// overlaps a a little, the contact points are those of that pose, and their gaps what b was moved by along
/// their normals. So two faces that will meet have the points of a patch, and not one.
class ContactsAhead {
 public:
  /// What the assets and the filter look at, and the filter, must outlive this. filter: or null; its motions
  /// are not looked at, and what it excludes may change between calls. Throws QueryFailed.
  ContactsAhead(std::span<const AssetView> assets, std::uint32_t threads, const PairFilter* filter = nullptr);

  /// Finds which bodies are near each other. Throws QueryFailed.
  void find_near(const BodiesAhead& of);

  /// Return the pairs that are near each other, ascending, until the next find_near(). Slow: points move
  /// against each other by no more than the slop in this step, so that a pair keeps what was found of it
  /// until it has moved by more than that. Fast: the others, but for those that surely do not touch.
  std::span<const ObjectPair> slow() const { return slow_; }
  std::span<const ObjectPair> fast() const { return fast_; }

  /// Adds the contacts ahead of pairs to those found, so that these still come by ascending pair. Pairs that
  /// have contacts, slow ones that are kept, and those of two idle bodies have none. The result depends on
  /// nothing but the arguments. Condition: find_near() was called for the same bodies. Throws QueryFailed.
  void add_to(std::vector<ContactPoint>& found, std::span<const ObjectPair> kept, const BodiesAhead& of);

 private:
  /// A pair, and how far apart its bodies are at least.
  struct Apart {
    ObjectPair pair;
    double distance = 0;
    double reach = 0;  ///< how far apart they may be and meet within the step
    bool slow = false;
  };
  /// A pair whose bodies are nearer than its reach, by place in apart_.
  struct Asked {
    std::size_t place;
    ObjectDistance distance;
  };
  struct Approach {
    ObjectPair pair;
    Vector3 way;  ///< of b, until it overlaps a
  };
  void place(const BodiesAhead& of);
  void follow(const BodiesAhead& of);
  bool is_still(std::uint32_t body) const { return motion_[body] == Motion::fixed; }
  double turning_of(const ObjectPair& pair) const { return turning_[pair.a] + turning_[pair.b]; }
  Vector3 approach_of(const ObjectPair& pair, std::span<const BodyState> states) const;
  double farthest(const BodiesAhead& of) const;
  void find_distances(std::span<const ContactPoint> found, std::span<const ObjectPair> kept, double overlap);
  void find_approaches(const BodiesAhead& of);
  void find_points(const BodiesAhead& of);

  const PairFilter* filter_;
  Scene scene_, moved_;  // all bodies; two of each approach, moved
  DistanceQuery distances_;
  ContactQuery contacts_;
  ManifoldQuery manifolds_;

  std::vector<BodyState> before_;  // of the last call
  std::vector<double> way_;        // that points of each body have moved since then, at most
  std::vector<Apart> apart_, now_apart_;
  std::vector<ObjectPair> slow_, fast_;
  std::vector<Motion> motion_;
  std::vector<double> turning_;  // how fast points of each body move by its spin, at most
  std::vector<Instance> instances_;
  std::vector<ObjectPair> pairs_, moved_pairs_;
  std::vector<Asked> asked_;
  std::vector<Approach> approaches_;
  std::vector<ContactPoint> points_;
};

}  // namespace tandem::dynamics
