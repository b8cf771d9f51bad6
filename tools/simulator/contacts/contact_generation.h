#pragma once
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "engines/engine.h"
#include "simulator/contact_point.h"

namespace tandem::simulation {

struct ContactOptions {
  std::uint32_t points_per_patch = 8;  ///< at most, from 1
};

/// What became of a list of triangle pairs.
struct ContactStatistics {
  std::uint64_t triangle_pairs = 0;
  std::uint64_t segments = 0;           ///< triangle pairs whose intersection has a length
  std::uint64_t patches = 0;            ///< connected regions of contact
  std::uint64_t open_curves = 0;        ///< patches whose intersection curves do not close
  std::uint64_t ambiguous_touches = 0;  ///< of corner on corner or edge along edge, which give no point
  std::uint64_t candidate_points = 0;   ///< before the reduction
  std::uint64_t points = 0;
  double area = 0;   ///< of all patches, seen along their normals
  double depth = 0;  ///< the largest
};

/// Makes contact points of pairs of triangles that meet. The same bytes on every run, for any number of
/// threads (those of oneTBB). Throws std::bad_alloc alone. Movable, not copyable.
class ContactGenerator {
 public:
  ContactGenerator();
  ContactGenerator(ContactGenerator&&) noexcept;
  ContactGenerator& operator=(ContactGenerator&&) noexcept;
  ~ContactGenerator();

  /// Names the shapes that bodies refer to, the list given to the engine. What the views look at must outlive
  /// the generator's use.
  void set_shapes(std::span<const AssetView> shapes);

  /// The points come by ascending pair of bodies. Valid until the next call. Condition: `found` is an
  /// engine's answer for these bodies.
  const std::vector<ContactPoint>& generate(const ContactList& found, std::span<const BodyPose> bodies,
                                            const ContactOptions& options = {});

  /// Of the last call.
  const ContactStatistics& statistics() const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace tandem::simulation
