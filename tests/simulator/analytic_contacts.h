#pragma once
#include <memory>
#include <span>
#include <vector>

#include "bvhbench/simulator/simulator.h"

/// Contacts by formula, for tests of the simulator without meshes.
namespace tandem::simulation {

inline constexpr double kGravity = 9.81;
/// The size of the boxes that most tests stack.
inline constexpr Vector3 kCube = {1, 1, 1};
inline constexpr Vector3 kUp = {0, 0, 1};

/// A box of this mass with its centre at the origin of its frame.
BodyProperties box_body(const Vector3& size, double mass);

/// A solid ball of this mass with its centre at the origin of its frame.
BodyProperties ball_body(double radius, double mass);

/// A body that nothing moves.
BodyProperties fixed_body();

/// Judges whether pairs have moved, of bodies whose bounds are cubes about the origin of their frame.
class PairJudge {
 public:
  /// Returns which of these pairs are kept, and takes the others as found now. Conditions: a radius for
  /// each body, that of its bounds; pairs are ascending.
  std::vector<ObjectPair> kept(std::span<const ObjectPair> pairs, std::span<const BodyPose> bodies,
                               std::span<const double> radii, double tolerance);

  std::span<const PosedBodies> posed() const { return posed_; }
  void resume(std::span<const PosedBodies> posed) { posed_.assign(posed.begin(), posed.end()); }

 private:
  std::vector<PosedBodies> posed_;  // by ascending pair
};

/// Contacts by formula, which pairs keep.
class AnalyticContacts : public ContactFinder {
 public:
  const std::vector<ContactPoint>& find(std::span<const BodyPose> bodies, std::span<const std::uint8_t> idle,
                                        const Keeping& keeping) final;
  std::span<const PosedBodies> posed() const final { return judge_.posed(); }
  void resume(std::span<const PosedBodies> posed) final { judge_.resume(posed); }

 protected:
  /// Finds the contacts of all pairs.
  virtual void find_all(std::span<const BodyPose> bodies, std::vector<ContactPoint>& points) = 0;
  virtual double radius(std::uint32_t body) const = 0;

 private:
  std::vector<ContactPoint> points_;
  PairJudge judge_;
};

/// Body 0 is the half-space below the plane through the origin with this normal; the other bodies are boxes.
/// The corners of each box that lie in the half-space are contacts, and so are those bottom corners of box i
/// + 1 that lie below the top of box i, over its footprint in the frame of box i.
///
/// The k-th time that contacts are found, they are deeper by k % 3 times `flicker`.
std::unique_ptr<ContactFinder> boxes_on_plane(const Vector3& normal, const Vector3& size, double flicker = 0);

/// Body 0 is the half-space as above; the other bodies are balls. Each has one contact with it, at its foot.
std::unique_ptr<ContactFinder> balls_on_plane(const Vector3& normal, double radius);

/// No contacts.
std::unique_ptr<ContactFinder> no_contacts();

}  // namespace tandem::simulation
