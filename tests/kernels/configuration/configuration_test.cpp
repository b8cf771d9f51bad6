#include "kernels/configuration/configuration_tests.h"

#include <new>

#include "kernels/scene/scene_state.h"

namespace tandem {
namespace {

// A device that asks a scene of its own on the CPU.
class CpuDevice final : public SceneDevice {
 public:
  CpuDevice() { state_bytes = sizeof(SceneState); }

  Status set_assets(SceneState& scene) override {
    std::vector<AssetView> views;
    for (const SceneAsset& asset : scene.assets.view()) views.push_back(asset.view);
    return scene_.set_assets(views);
  }
  Status find_pairs(SceneState& scene, double reach, bool& fixed_kept, Buffer<ObjectPair>& pairs) override {
    fixed_kept = false;
    Status status = take_bodies(scene);
    if (status == Status::kOk) status = scene_.find_pairs(reach);
    return status == Status::kOk ? copy(scene_.pairs(), pairs) : status;
  }
  Status find(SceneState& scene, const ContactOptions& options,
              const DeviceAnswer<Contact, ContactCounters>& found) override {
    return ask(scene, options, found, contacts_);
  }
  Status find(SceneState& scene, const DistanceOptions& options,
              const DeviceAnswer<ObjectDistance, DistanceCounters>& found) override {
    return ask(scene, options, found, distances_);
  }

  Status deform(SceneState&, std::uint32_t, std::span<const float>) override { return Status::kBadOption; }
  Status deform(SceneState&, std::uint32_t, std::span<const double>) override { return Status::kBadOption; }
  Status find(SceneState&, const ClosestOptions&,
              const DeviceAnswer<ClosestPoint, ClosestCounters>&) override {
    return Status::kBadOption;
  }
  Status find(SceneState&, const RayOptions&, const DeviceAnswer<RayHit, RayCounters>&) override {
    return Status::kBadOption;
  }
  Status find(SceneState&, const ToleranceOptions&,
              const DeviceAnswer<PairVerdict, ToleranceCounters>&) override {
    return Status::kBadOption;
  }
  Status find(SceneState&, const ImpactOptions&, bool, const DeviceAnswer<Impact, ImpactCounters>&) override {
    return Status::kBadOption;
  }
  Status find(SceneState&, const ManifoldOptions&, const MovedQuery*, const DeviceMemory&,
              Buffer<ManifoldPoint>&, const DeviceAnswer<Manifold, ManifoldCounters>&) override {
    return Status::kBadOption;
  }
  Status find(SceneState&, const DeviceMemory&,
              const DeviceAnswer<Containment, ContainmentCounters>&) override {
    return Status::kBadOption;
  }

 private:
  // A device takes the bodies where their version is another one.
  Status take_bodies(const SceneState& scene) {
    if (version_ == scene.version) return Status::kOk;
    version_ = scene.version;
    return scene_.place(scene.instances.view(), scene.filter());
  }
  template <typename Row>
  static Status copy(std::span<const Row> from, Buffer<Row>& to) {
    if (!to.resize(from.size())) return Status::kOutOfMemory;
    std::copy(from.begin(), from.end(), to.data());
    return Status::kOk;
  }
  template <typename Options, typename Found, typename Query>
  Status ask(SceneState& scene, const Options& options, const Found& found, Query& query) {
    Status status = take_bodies(scene);
    if (status == Status::kOk) status = query.find(scene_, found.pairs.view(), options);
    return status == Status::kOk ? copy(query.rows(), found.rows) : status;
  }

  Scene scene_;
  std::uint64_t version_ = ~std::uint64_t{0};
  ContactQuery contacts_;
  DistanceQuery distances_;
};

class SceneOfDevice : public Scene {
 public:
  SceneOfDevice() { EXPECT_EQ(answer_on(new (std::nothrow) CpuDevice), Status::kOk); }
};

}  // namespace

INSTANTIATE_TYPED_TEST_SUITE_P(Cpu, ConfigurationsOn, testing::Types<Scene>);
INSTANTIATE_TYPED_TEST_SUITE_P(Device, ConfigurationsOn, testing::Types<SceneOfDevice>);

}  // namespace tandem
