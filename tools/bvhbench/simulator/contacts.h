#pragma once
#include <Eigen/Core>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "rigid_body.h"
#include "tandem/kernels/manifold_query.h"
#include "tandem/kernels/moved_query.h"

namespace tandem::simulation {

/// A point in which two bodies push against each other: what a solver makes one contact of.
struct ContactPoint {
  std::uint32_t body_a, body_b;  ///< a < b
  Eigen::Vector3d position;      ///< world
  Eigen::Vector3d normal;        ///< unit, from a towards b: pushing b along it separates the bodies
  double depth;                  ///< lengths along the normal; where bodies are apart, less than 0
  std::uint64_t feature;         ///< equal in successive steps for what is the same contact; 0: none, to be
                                 ///< matched by position
};

/// The place of a contact's point in its bodies' frames about their centres of mass, which carry it along.
struct ContactAnchor {
  Eigen::Vector3d in_a, in_b;
  double depth;  ///< when the contact was found
};

ContactAnchor anchor_of(const ContactPoint& contact, std::span<const BodyState> states);

/// Moves a contact to the middle of where its two bodies have carried the point, and corrects its depth by
/// what these have moved apart along the normal; the depth may become negative. The normal stays.
void carry(ContactPoint& contact, const ContactAnchor& anchor, std::span<const BodyState> states);

/// A unit vector across the normal, the same for the same normal.
Eigen::Vector3d across(const Eigen::Vector3d& normal);

/// The impulse of a contact in a step: an impulse on b, the opposite one on a.
struct ContactImpulse {
  double normal = 0;                                     ///< along the contact's normal, >= 0
  Eigen::Vector3d tangential = Eigen::Vector3d::Zero();  ///< across it, in the world
  Eigen::Vector3d turning = Eigen::Vector3d::Zero();     ///< what resists turning, in the world; each contact
                                                         ///< of a pair has an equal part
};

/// Counts what became of a list of triangle pairs.
struct ContactStatistics {
  ManifoldCounters counters;
  double area = 0;   ///< of all manifolds, seen along their normals
  double depth = 0;  ///< the largest
};

/// Makes contact points of pairs of triangles that meet, by the library's ManifoldQuery. The bytes are the
/// same on every run, for any number of threads. Throws EngineError where it fails.
class ContactGenerator {
 public:
  /// Names the shapes that bodies refer to, the list given to the engine. What the views look at must outlive
  /// the generator's use.
  void set_shapes(std::span<const AssetView> shapes);

  /// Finds which of these pairs have moved by more than a tolerance, see MovedQuery.
  const MovedQuery& find_moved(std::span<const ObjectPair> pairs, std::span<const BodyPose> bodies,
                               double tolerance, std::uint32_t threads);

  /// Lets the next call of find_moved() go on from these.
  void resume(std::span<const PosedBodies> posed);
  std::span<const PosedBodies> posed() const { return moved_.posed(); }

  /// The points come by ascending pair of bodies, those of the pairs `left_out` not at all. Valid until the
  /// next call. Conditions: `found` is an engine's answer for these bodies; left_out is ascending.
  const std::vector<ContactPoint>& generate(const ContactList& found, std::span<const BodyPose> bodies,
                                            std::span<const ObjectPair> left_out, std::uint32_t threads = 1);

  /// Returns the statistics of the last call.
  const ContactStatistics& statistics() const { return statistics_; }

 private:
  void place(std::span<const BodyPose> bodies, std::uint32_t threads);

  Scene scene_;
  MovedQuery moved_;
  ManifoldQuery manifolds_;
  std::vector<Contact> contacts_;
  std::vector<ContactPoint> points_;
  ContactStatistics statistics_;
};

/// Says how contacts were found.
struct FinderReport {
  EngineTimes engine;
  double generation = 0;  ///< seconds for making points of triangle pairs
  ContactCounters counters;
  ContactStatistics contacts;
  std::uint64_t kept_pairs = 0;
};

/// Says which pairs keep the contacts that they have.
struct Keeping {
  std::span<const ObjectPair> remembered;  ///< whose contacts the caller remembers, ascending
  double tolerance;  ///< a pair keeps them until it has moved by more than this, see MovedQuery
};

/// A simulator has its contacts from one of these.
class ContactFinder {
 public:
  virtual ~ContactFinder() = default;

  /// The contacts of bodies that stand like this, by ascending pair of bodies; those of kept() are left out,
  /// and those of two idle bodies may be. Valid until the next call. Condition: idle is empty or has an entry
  /// for each body.
  virtual const std::vector<ContactPoint>& find(std::span<const BodyPose> bodies,
                                                std::span<const std::uint8_t> idle,
                                                const Keeping& keeping) = 0;

  /// Returns the pairs of the last call that keep the contacts that they had: whose boxes meet, or that were
  /// remembered. Ascending.
  std::span<const ObjectPair> kept() const { return kept_; }

  /// Return what the next call takes the motion of pairs from, and let it go on from there.
  virtual std::span<const PosedBodies> posed() const = 0;
  virtual void resume(std::span<const PosedBodies> posed) = 0;

  /// Returns the report of the last call.
  const FinderReport& report() const { return report_; }

 protected:
  FinderReport report_;
  std::vector<ObjectPair> kept_;
};

/// Contacts of meshes: a collision engine finds the triangles that meet, and points are made of them. What
/// the shapes look at must outlive it. asks_all: the engine is asked about pairs that are kept too, so that
/// its times and counters are of all pairs.
std::unique_ptr<ContactFinder> make_mesh_contact_finder(std::unique_ptr<Engine> engine,
                                                        std::span<const AssetView> shapes,
                                                        std::uint32_t threads, bool asks_all = false);

}  // namespace tandem::simulation
