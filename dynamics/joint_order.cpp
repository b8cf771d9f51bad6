#include "dynamics/joint_order.h"

#include <algorithm>

#include "dynamics/pair_colours.h"

namespace tandem::dynamics {
namespace {

bool is_moved(std::uint32_t body, std::span<const Motion> motions) {
  return body != kNoIndex && motions[body] == Motion::moving;
}

}  // namespace

std::vector<Motion> motions_of(std::span<const BodyProperties> bodies) {
  std::vector<Motion> out;
  out.reserve(bodies.size());
  for (const BodyProperties& body : bodies) out.push_back(body.motion);
  return out;
}

std::vector<std::uint32_t> find_joint_colours(std::span<const Joint> joints,
                                              std::span<const Motion> motions) {
  const auto place = [&](std::uint32_t body) { return is_moved(body, motions) ? body + 1 : 0; };
  // Joints have their colours in their order, so that those of a chain have two.
  std::vector<ColouredPair> pairs;
  pairs.reserve(joints.size());
  for (const Joint& joint : joints) pairs.push_back({place(joint.pair().a), place(joint.pair().b), 0});
  return find_colours(pairs, motions.size() + 1);
}

JointOrder find_joint_order(std::span<const Joint> joints, std::span<const Motion> motions) {
  const std::vector<std::uint32_t> colours = find_joint_colours(joints, motions);
  const std::size_t colour_count = colours.empty() ? 0 : *std::ranges::max_element(colours) + 1;
  JointOrder out;
  out.joints_of.resize(motions.size());
  const auto take_turn = [&](std::uint32_t body) {
    return is_moved(body, motions) ? out.joints_of[body]++ : 0;
  };
  const auto end_colours = [&](std::size_t end) {
    out.places.resize((out.places.size() + kJointsOfTeam - 1) / kJointsOfTeam * kJointsOfTeam);
    out.colour_end.resize(end, out.tasks());
  };
  for (const std::uint32_t i : sorted_by(all_below(joints.size()), colour_count,
                                         [&](std::uint32_t joint) { return colours[joint]; })) {
    if (!joints[i].holds) continue;
    if (colours[i] > out.colour_end.size()) end_colours(colours[i]);
    out.places.push_back({i, take_turn(joints[i].a), take_turn(joints[i].b)});
  }
  end_colours(colour_count);
  return out;
}

}  // namespace tandem::dynamics
