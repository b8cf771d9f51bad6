#pragma once
#include <memory>
#include <span>
#include <vector>

#include "bvhbench/engines/engine.h"
#include "bvhbench/simulator/contacts/contact_generation.h"
#include "contact_point.h"

namespace tandem::simulation {

/// How contacts were found.
struct FinderReport {
  EngineTimes engine;
  double generation = 0;  ///< seconds for making points of triangle pairs
  ContactCounters counters;
  ContactStatistics contacts;
};

/// Where a simulator has its contacts from.
class ContactFinder {
 public:
  virtual ~ContactFinder() = default;

  /// The contacts of bodies that stand like this, by ascending pair of bodies; pairs of two idle ones and
  /// those of `unmoved` may be left out. Valid until the next call. Conditions: idle is empty or has an entry
  /// for each body; unmoved is ascending.
  virtual const std::vector<ContactPoint>& find(std::span<const BodyPose> bodies,
                                                std::span<const std::uint8_t> idle,
                                                std::span<const BodyPair> unmoved) = 0;

  /// Of the last call.
  const FinderReport& report() const { return report_; }

 protected:
  FinderReport report_;
};

/// Contacts of meshes: a collision engine finds the triangles that meet, and points are made of them. What
/// the shapes look at must outlive it.
std::unique_ptr<ContactFinder> make_mesh_contact_finder(std::unique_ptr<Engine> engine,
                                                        std::span<const AssetView> shapes,
                                                        const ContactPointOptions& options);

}  // namespace tandem::simulation
