#include "animation.h"

#include <algorithm>
#include <cmath>

#include "animation_data.h"

namespace tandem::build {
namespace {

using Quaternion = std::array<double, 4>;

Quaternion normalised(const Quaternion& q) {
  const double length = std::sqrt((q[0] * q[0] + q[1] * q[1]) + (q[2] * q[2] + q[3] * q[3]));
  return length > 0 ? Quaternion{q[0] / length, q[1] / length, q[2] / length, q[3] / length} : q;
}

double dot(const Quaternion& a, const Quaternion& b) {
  return (a[0] * b[0] + a[1] * b[1]) + (a[2] * b[2] + a[3] * b[3]);
}

// Turns from a to b at an even pace, the shorter way. The middle of an arc is the sum of its ends, made as
// long as they are, so halving the arc needs no sine. After 20 halvings of at most 90 degrees the arc is
// shorter than 2^-19, and a chord differs from it by less than the roundings do.
Quaternion turned_between(Quaternion a, Quaternion b, double u) {
  constexpr int kHalvings = 20;
  a = normalised(a), b = normalised(b);
  if (dot(a, b) < 0) {
    for (double& part : b) part = -part;
  }
  for (int i = 0; i < kHalvings; ++i) {
    Quaternion middle;
    for (std::size_t k = 0; k < 4; ++k) middle[k] = a[k] + b[k];
    middle = normalised(middle);
    const bool is_later = u >= 0.5;
    (is_later ? a : b) = middle;
    u = is_later ? 2 * u - 1 : 2 * u;
  }
  for (std::size_t k = 0; k < 4; ++k) a[k] += u * (b[k] - a[k]);
  return normalised(a);
}

// The place of a time between the keys of a channel.
struct KeyPlace {
  std::size_t key = 0;
  double u = 0;  // from 0 at the key to 1 at the next one
};

KeyPlace place_of(const std::vector<double>& times, double seconds) {
  if (!(seconds > times.front())) return {0, 0};
  if (seconds >= times.back()) return {times.size() - 1, 0};
  const auto next = std::upper_bound(times.begin(), times.end(), seconds);
  const auto key = static_cast<std::size_t>(next - times.begin() - 1);
  return {key, (seconds - times[key]) / (times[key + 1] - times[key])};
}

// Hermite's cubic between two keys (glTF 2.0, appendix C.5).
double cubic(const AnimationChannel& channel, const KeyPlace& place, std::size_t k) {
  const double u = place.u, length = channel.times[place.key + 1] - channel.times[place.key];
  const auto number = [&](std::size_t key, std::size_t part) {
    return channel.values[(3 * key + part) * channel.width + k];
  };
  const double u2 = u * u, u3 = u2 * u;
  return (2 * u3 - 3 * u2 + 1) * number(place.key, 1) + (u3 - 2 * u2 + u) * length * number(place.key, 2) +
         (3 * u2 - 2 * u3) * number(place.key + 1, 1) + (u3 - u2) * length * number(place.key + 1, 0);
}

Quaternion quaternion_at(const double* numbers) {
  return {numbers[0], numbers[1], numbers[2], numbers[3]};
}

void value_at(const AnimationChannel& channel, double seconds, std::vector<double>& value) {
  const KeyPlace place = place_of(channel.times, seconds);
  const std::size_t width = channel.width;
  const bool is_cubic = channel.interpolation == Interpolation::cubic_spline;
  const double* here = channel.values.data() + (is_cubic ? 3 * place.key + 1 : place.key) * width;
  value.assign(here, here + width);
  if (place.u == 0 || channel.interpolation == Interpolation::step) return;
  if (is_cubic) {
    for (std::size_t k = 0; k < width; ++k) value[k] = cubic(channel, place, k);
    return;
  }
  const double* next = here + width;
  if (channel.path == AnimatedPath::rotation) {
    const Quaternion q = turned_between(quaternion_at(here), quaternion_at(next), place.u);
    value.assign(q.begin(), q.end());
    return;
  }
  for (std::size_t k = 0; k < width; ++k) value[k] += place.u * (next[k] - here[k]);
}

void set_state(const AnimationChannel& channel, const std::vector<double>& value, NodeState& state) {
  switch (channel.path) {
    case AnimatedPath::translation:
      state.parts.translation = {value[0], value[1], value[2]};
      return;
    case AnimatedPath::scale:
      state.parts.scale = {value[0], value[1], value[2]};
      return;
    case AnimatedPath::rotation:
      state.parts.rotation = quaternion_at(value.data());
      return;
    case AnimatedPath::weights:
      state.weights = value;
  }
}

// The nodes of a scene at one time.
class ScenePose {
 public:
  explicit ScenePose(const AnimationData& data) : data_(data), world_(data.nodes.size(), kIdentity) {
    for (const AnimatedNode& node : data.nodes) {
      local_.push_back(node.local);
      states_.push_back(node.rest);
    }
  }

  void animate(const AnimationTime& time) {
    const AnimationClip& clip = data_.clips[time.clip];
    const double seconds = std::min(std::max(time.seconds, clip.begin), clip.end);
    std::vector<double> value;
    for (const AnimationChannel& channel : data_.channels[time.clip]) {
      value_at(channel, seconds, value);
      set_state(channel, value, states_[channel.node]);
    }
    for (const AnimationChannel& channel : data_.channels[time.clip]) {
      if (channel.path != AnimatedPath::weights)
        local_[channel.node] = affine_of(states_[channel.node].parts);
    }
  }

  void positions(std::vector<Point>& out) {
    for (const std::uint32_t node : data_.order) {
      const int parent = data_.nodes[node].parent;
      world_[node] =
          parent < 0 ? local_[node] : combined(world_[static_cast<std::size_t>(parent)], local_[node]);
    }
    out.clear();
    out.reserve(data_.vertex_count);
    for (const VertexRun& run : data_.runs) add(run, out);
  }

 private:
  void add(const VertexRun& run, std::vector<Point>& out) {
    if (run.skin >= 0) place_joints(data_.skins[static_cast<std::size_t>(run.skin)]);
    const std::vector<double>& weights = states_[run.node].weights;
    for (std::size_t v = 0; v < run.base.size(); ++v) {
      Point point = run.base[v];
      for (std::size_t t = 0; t < run.targets.size() && t < weights.size(); ++t) {
        if (weights[t] == 0) continue;
        for (std::size_t k = 0; k < 3; ++k) point[k] += weights[t] * run.targets[t][v][k];
      }
      out.push_back(transformed(run.skin >= 0 ? blended(run, v) : world_[run.node], point));
    }
  }

  void place_joints(const AnimatedSkin& skin) {
    joints_.resize(skin.joints.size());
    for (std::size_t j = 0; j < joints_.size(); ++j)
      joints_[j] = combined(world_[skin.joints[j]], skin.inverse_bind[j]);
  }

  Affine blended(const VertexRun& run, std::size_t vertex) const {
    Affine sum{};
    for (std::uint32_t i = run.influence_begin[vertex]; i < run.influence_begin[vertex + 1]; ++i) {
      const Influence& influence = run.influences[i];
      for (std::size_t row = 0; row < 3; ++row) {
        for (std::size_t column = 0; column < 4; ++column)
          sum[row][column] += influence.weight * joints_[influence.joint][row][column];
      }
    }
    return sum;
  }

  const AnimationData& data_;
  std::vector<Affine> local_, world_, joints_;
  std::vector<NodeState> states_;
};

}  // namespace

const std::vector<AnimationClip>& Animation::clips() const {
  return data_->clips;
}

std::size_t Animation::vertex_count() const {
  return data_->vertex_count;
}

void Animation::rest(std::vector<Point>& positions) const {
  ScenePose(*data_).positions(positions);
}

void Animation::at(const AnimationTime& time, std::vector<Point>& positions) const {
  ScenePose pose(*data_);
  pose.animate(time);
  pose.positions(positions);
}

std::vector<AnimationTime> spread_times(const std::vector<AnimationClip>& clips, std::size_t count) {
  double whole = 0;
  for (const AnimationClip& clip : clips) whole += clip.seconds();
  std::vector<AnimationTime> times;
  if (!(whole > 0)) {
    for (std::size_t clip = 0; clip < std::min(count, clips.size()); ++clip)
      times.push_back({clip, clips[clip].begin});
    return times;
  }
  std::size_t clip = 0;
  double before = 0;  // the clip at hand
  for (std::size_t i = 0; i < count; ++i) {
    const double at = (static_cast<double>(i) + 0.5) / static_cast<double>(count) * whole;
    while (clip + 1 < clips.size() && at > before + clips[clip].seconds()) before += clips[clip++].seconds();
    times.push_back({clip, clips[clip].begin + (at - before)});
  }
  return times;
}

}  // namespace tandem::build
