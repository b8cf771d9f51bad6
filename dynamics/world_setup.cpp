#include "dynamics/world_setup.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <stdexcept>

namespace tandem::dynamics {
namespace {

// Bodies that rest in a heap creep more slowly than this, in m/s.
constexpr double kSleepSpeed = 0.03;

// It is false of NaN too.
bool is_option(double x, double least, double most) {
  return x >= least && x <= most;
}

constexpr double kMost = 1e6;  // of options that are numbers

Status check(const WorldOptions& options) {
  bool good = is_option(options.friction, 0, kMost) && is_option(options.restitution, 0, 1) &&
              options.slop <= kMost && options.rolling_resistance <= kMost &&
              is_option(options.substeps, 1, 10'000) && is_option(options.threads, 1, kMostSceneThreads);
  for (const double g : options.gravity) good = good && is_option(g, -kMost, kMost);
  return good ? Status::kOk : Status::kBadOption;
}

// Masses of assets, found once.
class Masses {
 public:
  explicit Masses(std::span<const AssetView> assets) : assets_(assets), of_(assets.size()) {}

  Status find(const BodyDescription& from, BodyProperties& body) {
    body.shape = from.asset;
    body.motion = from.filter.motion == Motion::sleeping ? Motion::moving : from.filter.motion;
    const AssetView& asset = assets_[from.asset];
    if (body.motion == Motion::fixed) {
      body.radius = radius_about({}, asset);
      return Status::kOk;
    }
    if (!(from.density > 0 && std::isfinite(from.density))) return Status::kNoMass;
    if (asset.level().topology == nullptr) return Status::kNoTopology;
    if (!of_[from.asset]) {
      try {
        of_[from.asset] = body_properties(from.asset, mass_properties(asset).properties, 1);
      } catch (const std::runtime_error&) {
        return Status::kNoMass;
      }
      of_[from.asset]->radius = radius_about(of_[from.asset]->centre, asset);
    }
    const Motion motion = body.motion;
    body = of_density(*of_[from.asset], from.density);
    body.motion = motion;
    return is_usable_mass(body.mass) ? Status::kOk : Status::kOutOfRange;
  }

 private:
  std::span<const AssetView> assets_;
  std::vector<std::optional<BodyProperties>> of_;
};

SimulationOptions simulation_options(const WorldOptions& options, std::span<const AssetView> assets,
                                     std::span<const BodyProperties> bodies) {
  SimulationOptions to;
  to.gravity = vector_of(options.gravity);
  to.solver.friction = options.friction, to.solver.restitution = options.restitution;
  to.solver.slop = options.slop >= 0 ? options.slop : default_slop(assets, bodies);
  to.solver.rolling_resistance =
      options.rolling_resistance >= 0 ? options.rolling_resistance : 16 * to.solver.slop;
  to.solver.substeps = options.substeps;
  to.sleep.enabled = options.sleeping;
  to.sleep.speed = kSleepSpeed;
  to.threads = options.threads;
  return to;
}

}  // namespace

Status exclude_joined(std::span<const ObjectPair> excluded, std::span<const Joint> joints,
                      ExcludedPairTable& table) {
  std::vector<ObjectPair> pairs(excluded.begin(), excluded.end());
  for (const Joint& joint : joints) {
    if (joint.holds && !joint.may_touch && joint.a != kNoIndex && joint.b != kNoIndex)
      pairs.push_back(joint.pair());
  }
  return table.set(pairs);
}

bool is_usable(const BodySettings& body) {
  const Material& material = body.material;
  return is_option(body.gravity_scale, -kMost, kMost) && material.friction <= kMost &&
         material.restitution <= 1 && material.rolling_resistance <= kMost;
}

Status check(const JointDescription& joint, std::span<const BodyProperties> bodies) {
  bool moves = false;
  for (const std::uint32_t body : {joint.a, joint.b}) {
    if (body == kNoIndex) continue;
    if (body >= bodies.size()) return Status::kUnknownInstance;
    moves = moves || bodies[body].motion == Motion::moving;
  }
  if (!moves || joint.a == joint.b) return Status::kJoinsNothing;
  return dynamics::check(joint);
}

Status set_up(std::span<const AssetView> assets, std::span<const BodyDescription> bodies,
              const WorldOptions& options, std::span<const JointDescription> joints, WorldSetup& setup,
              std::uint64_t& where) {
  setup = {};
  where = 0;
  if (check(options) != Status::kOk) return Status::kBadOption;
  Masses masses(assets);
  for (where = 0; where < bodies.size(); ++where) {
    const BodyDescription& from = bodies[where];
    if (from.asset >= assets.size()) return Status::kUnknownAsset;
    if (!is_rigid(from.pose)) return Status::kPoseNotRigid;
    BodyProperties& body = setup.properties.emplace_back();
    const Status status = masses.find(from, body);
    if (status != Status::kOk) return status;
    body.material = from.material, body.gravity_scale = from.gravity_scale;
    BodyState& state = setup.states.emplace_back(state_of(body, from.pose));
    if (body.motion != Motion::fixed) {
      state.velocity = vector_of(from.velocity);
      state.angular_velocity = vector_of(from.angular_velocity);
    }
    if (!is_usable(body) || !is_usable(state)) return Status::kOutOfRange;
    setup.group.push_back(from.filter.group), setup.mask.push_back(from.filter.mask);
    setup.world.push_back(from.filter.world);
  }
  for (where = 0; where < joints.size(); ++where) {
    const Status status = check(joints[where], setup.properties);
    if (status != Status::kOk) return status;
    setup.joints.push_back(make_joint(joints[where], setup.states));
  }
  where = 0;
  setup.options = simulation_options(options, assets, setup.properties);
  return Status::kOk;
}

}  // namespace tandem::dynamics
