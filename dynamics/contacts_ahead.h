#pragma once
#include <span>
#include <vector>

#include "dynamics/contact_finder.h"
#include "dynamics/pair_ahead.h"
#include "dynamics/threads.h"
#include "tandem/kernels/distance_query.h"

namespace tandem::dynamics {

/// A pair of bodies, and how far apart they are at least.
struct PairApart {
  ObjectPair pair;
  double distance = 0;
};

/// Has what is known of distances: where bodies stood then, and the pairs that were apart, ascending.
struct AheadState {
  std::vector<BodyState> before;
  std::vector<PairApart> apart;
};

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
  ContactsAhead(std::span<const AssetView> assets, const Threads& threads,
                const PairFilter* filter = nullptr);

  /// Finds which bodies are near each other. Throws QueryFailed.
  void find_near(const BodiesAhead& of);

  /// Return the pairs that may meet within the step, ascending, until the next find_near(). Slow: points move
  /// against each other by no more than the slop in this step, so that a pair keeps what was found of it
  /// until it has moved by more than that. Fast: the others, but for those that surely do not touch.
  std::span<const ObjectPair> slow() const { return slow_; }
  std::span<const ObjectPair> fast() const { return fast_; }

  /// Finds the contacts that fast pairs which touched will have in the middle of the step, if the bodies go
  /// on as they do. A body that rolls, swings or slides takes its contacts along: those of the middle act for
  /// the whole step with an error of second order in it, those of the start with one of first order. Result:
  /// the pairs that have such contacts, ascending, valid until the next call of a function that finds any;
  /// add_to() adds them. remembered: of the step before, by ascending pair. Condition: find_near() was called
  /// for the same bodies. Throws QueryFailed.
  std::span<const ObjectPair> find_in_middle(std::span<const CachedContact> remembered,
                                             const BodiesAhead& of);

  /// Returns the report of the last find_in_middle().
  const FinderReport& report() const { return report_; }

  /// Adds the contacts of the middle, and the contacts ahead of pairs, to those found, so that these still
  /// come by ascending pair. Pairs that have contacts, slow ones that are kept, and those of two idle bodies
  /// have none. The result depends on nothing but the arguments. Condition: find_near() and find_in_middle()
  /// were called for the same bodies. Throws QueryFailed.
  void add_to(std::vector<ContactPoint>& found, std::span<const ObjectPair> kept, const BodiesAhead& of);

  /// Adds to those found what a step missed: contacts of slow pairs that did not touch at its start and are
  /// deeper in each other than the slop at its end, because something pushed them. They are those of the end,
  /// carried back to the start, where they are gaps. known: with which the step was solved, by ascending
  /// pair. Result: the pairs that have such contacts, ascending; valid until the next call. Condition:
  /// add_to() was called with the same start. Throws QueryFailed.
  std::span<const ObjectPair> add_missed(std::vector<ContactPoint>& found,
                                         std::span<const ContactPoint> known, const BodiesAhead& start,
                                         std::span<const BodyState> end);

  /// Return what the next call takes distances from, and let it go on from there.
  AheadState save() const;
  void restore(AheadState state);

 private:
  struct Apart : PairApart {
    PairReach reach;
  };
  void place(const BodiesAhead& of);
  void follow(const BodiesAhead& of);
  static double farthest(const BodiesAhead& of);
  double between(const ObjectPair& pair) const { return way_between(ways_[pair.a], ways_[pair.b]); }
  void find_ways(std::span<const BodyProperties> bodies, std::span<const BodyState> from,
                 std::span<const BodyState> to);
  void find_approaches(std::span<const ContactPoint> found, std::span<const ObjectPair> kept,
                       const BodiesAhead& of);
  void find_points(const BodiesAhead& of);
  void find_surprised(std::span<const ContactPoint> known, const BodiesAhead& start,
                      std::span<const BodyState> end);
  void clear_moved();
  void add_moved(const Instance& a, const Instance& b);
  FinderReport find_points_of_moved();
  static void add_points(const std::vector<ContactPoint>& points, std::vector<ContactPoint>& found);

  const PairFilter* filter_;
  Threads threads_;
  std::vector<double> inner_radius_;  // of each shape; infinite where it is not closed
  Scene scene_, moved_;               // all bodies; two of each approach, moved
  DistanceQuery distances_;
  ContactQuery contacts_;
  ManifoldQuery manifolds_;

  FinderReport report_;
  std::vector<BodyState> before_;  // of the last call
  std::vector<BodyWay> ways_;
  std::vector<Apart> apart_, now_apart_;
  std::vector<ObjectPair> slow_, fast_;
  std::vector<Motion> motion_;
  std::vector<Instance> instances_;
  std::vector<ObjectPair> pairs_, moved_pairs_, of_middle_, missed_;
  std::vector<std::uint32_t> places_;  // of pairs_ in apart_
  std::vector<double> reaches_;
  std::vector<Approach> approaches_;
  std::vector<ContactPoint> points_, in_middle_;
};

}  // namespace tandem::dynamics
