#include "near_contact.h"

#include <algorithm>
#include <cmath>

namespace tandem {
namespace {

// No pose draws more numbers than this: 100 attempts take about 1,600.
constexpr std::uint64_t kDrawsForPose = std::uint64_t{1} << 20;
constexpr std::uint64_t kDrawsForSet = std::uint64_t{1} << 63;

}  // namespace

// b's centre moves along aim + distance * direction, from `outside` down to `beyond`.
struct NearContactPoses::Line {
  Rotation rotation;
  Vector aim, direction;
  double outside, beyond;
};

NearContactPoses::NearContactPoses(const Bounds& a, const Bounds& b, std::uint64_t seed, PoseSet set)
    : centre_a_(a.centre()),
      centre_b_(b.centre()),
      radius_b_(0.5 * b.diagonal()),
      smaller_radius_(std::min(0.5 * a.diagonal(), radius_b_)),
      aimed_at_(std::max(0.0, 1 - b.diagonal() / a.diagonal())),
      random_(Random(seed).next()) {
  for (int k = 0; k < 3; ++k) half_a_[k] = 0.5 * a.upper[k] - 0.5 * a.lower[k];
  if (set == PoseSet::validation) random_.skip(kDrawsForSet);
}

// The line's part within a's bounds, grown by b's radius on all sides: outside of it nothing touches.
NearContactPoses::Line NearContactPoses::draw_line(Random& random) const {
  Line line{random_rotation(random), {}, random_direction(random), HUGE_VAL, -HUGE_VAL};
  for (int k = 0; k < 3; ++k) {
    const double offset = aimed_at_ * half_a_[k] * random.between(-1, 1);
    line.aim[k] = centre_a_[k] + offset;
    if (line.direction[k] == 0) continue;
    const double reach = half_a_[k] + radius_b_;
    const double one = (reach - offset) / line.direction[k], other = (-reach - offset) / line.direction[k];
    line.outside = std::min(line.outside, std::max(one, other));
    line.beyond = std::max(line.beyond, std::min(one, other));
  }
  return line;
}

Pose NearContactPoses::pose_at(const Line& line, double distance) const {
  Vector position;
  for (int k = 0; k < 3; ++k) position[k] = line.aim[k] + distance * line.direction[k];
  return place(0, line.rotation, centre_b_, position).pose;
}

std::optional<double> NearContactPoses::first_contact(const Line& line, const Touching& touching) const {
  constexpr double kStepsForRadius = 64, kMostSteps = 4096;
  constexpr int kBisections = 16;
  const double length = line.outside - line.beyond;
  const double step = std::max(smaller_radius_ / kStepsForRadius, length / kMostSteps);
  double apart = line.outside, touches = apart - step;
  while (!touching(pose_at(line, touches))) {
    apart = touches;
    touches = apart - step;
    if (!(touches > line.beyond)) return std::nullopt;  // NaN included
  }
  for (int i = 0; i < kBisections; ++i) {
    const double middle = 0.5 * (apart + touches);
    (touching(pose_at(line, middle)) ? touches : apart) = middle;
  }
  return touches;
}

std::optional<NearContactPose> NearContactPoses::find(std::uint64_t number, const Touching& touching) const {
  constexpr int kMostLines = 100;
  Random random = random_;
  random.skip(number * kDrawsForPose);
  for (int i = 0; i < kMostLines; ++i) {
    const Line line = draw_line(random);
    const double depth = kLargestDepth * random.uniform();
    if (const std::optional<double> contact = first_contact(line, touching)) {
      return NearContactPose{pose_at(line, *contact - depth * smaller_radius_), depth};
    }
  }
  return std::nullopt;
}

}  // namespace tandem
