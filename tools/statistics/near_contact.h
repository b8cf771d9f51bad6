#pragma once
#include <cstdint>
#include <functional>
#include <optional>

#include "common/random_pose.h"

/// Random poses of two bodies close to first contact, by which trees are measured (docs/poses.md).
namespace tandem {

/// Two streams of a seed that have no random number in common: trees are made better on one and measured on
/// the other.
enum class PoseSet : std::uint8_t { training, validation };

struct NearContactPose {
  Pose b;        ///< of b's file coordinates; a stands at the identity
  double depth;  ///< how far b was pushed on from first contact, in radii of the smaller body
};

/// Says whether a, at the identity, and b in this pose have a point in common.
using Touching = std::function<bool(const Pose& b)>;

/// The poses of a pair of bodies. A pose depends on the bounds, the seed, the set and its number, and on
/// where the surfaces meet; not on trees, as long as `touching` is exact.
class NearContactPoses {
 public:
  /// A body is pushed on at most this far, in radii: half diagonals of bounds.
  static constexpr double kLargestDepth = 0.05;

  NearContactPoses(const Bounds& a, const Bounds& b, std::uint64_t seed, PoseSet set);

  /// Pose `number` of the set: b turned at random about the centre of its bounds and brought in from where
  /// nothing can touch, along a random line, in steps of 1/64 of the smaller radius (at most 4,096), up to
  /// the first step that touches; first contact is bisected within the last step, 16 times, and b then pushed
  /// on by 0 to 5 % of the smaller radius. The line aims at a point of a's bounds, scaled about their centre
  /// by max(0, 1 - radius_b / radius_a): bodies of one size meet centre to centre, a small one meets a large
  /// one all over. What is found is the outermost contact, unless all of it lies between two steps.
  /// Result: nothing where none of 100 lines leads to a contact. `touching` is asked some 100 times.
  /// Condition: number < 2^43.
  std::optional<NearContactPose> find(std::uint64_t number, const Touching& touching) const;

 private:
  struct Line;
  Line draw_line(Random& random) const;
  std::optional<double> first_contact(const Line& line, const Touching& touching) const;
  Pose pose_at(const Line& line, double distance) const;

  Vector centre_a_, half_a_, centre_b_;
  double radius_b_, smaller_radius_, aimed_at_;
  Random random_;
};

}  // namespace tandem
