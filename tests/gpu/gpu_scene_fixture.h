#pragma once
#include <cuda_runtime_api.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cctype>
#include <cstdlib>
#include <map>
#include <string>
#include <tuple>
#include <vector>

#include "gpu/needs_gpu.h"
#include "kernels/asked.h"
#include "kernels/query_scenes.h"
#include "tandem/formats/gpu_memory.h"
#include "tandem/formats/gpu_stream.h"
#include "tandem/kernels/gpu_contact_query.h"
#include "tandem/runtime/upload.h"

/// Tests of queries on a GPU share these.
namespace tandem::test {

inline constexpr QueryMode kModes[] = {QueryMode::exact, QueryMode::fast, QueryMode::boxes};

/// With TANDEM_GPU_BLOCKS=N, queries take N blocks at most, for tools that are slow where warps wait.
inline GpuContactOptions gpu_options(QueryMode mode, bool first_contact_only = false) {
  const char* blocks = std::getenv("TANDEM_GPU_BLOCKS");
  GpuContactOptions options = {mode, first_contact_only};
  if (blocks != nullptr) options.most_blocks = static_cast<std::uint32_t>(std::atoi(blocks));
  return options;
}

inline GpuContactOptions grouped_options(QueryMode mode = QueryMode::exact) {
  GpuContactOptions options = gpu_options(mode);
  options.grouped = true;
  return options;
}

/// The name of a test of a family of scenes.
template <typename Tested>
std::string family_name(const Tested& tested) {
  std::string name = tested.param.name;
  std::replace_if(
      name.begin(), name.end(), [](char c) { return std::isalnum(static_cast<unsigned char>(c)) == 0; }, '_');
  return name;
}

/// A copy in GPU memory.
template <typename Element>
GpuArray<Element> on_gpu(const std::vector<Element>& host) {
  GpuArray<Element> array;
  EXPECT_EQ(array.upload(host, nullptr), cudaSuccess);
  return array;
}

template <typename Element>
std::vector<Element> download(const Element* device, std::size_t count) {
  std::vector<Element> host(count);
  EXPECT_EQ(tandem::download<Element>(device, host, nullptr), cudaSuccess);
  return host;
}

/// The order of sorted contacts.
inline auto order_of(const Contact& c) {
  return std::tie(c.pair, c.face_a, c.face_b, c.triangle_a, c.triangle_b);
}

/// An order of contacts: by pair, then triangles.
inline bool comes_before(const Contact& x, const Contact& y) {
  const auto key = [](const Contact& c) {
    return std::tie(c.pair, c.triangle_a, c.triangle_b, c.face_a, c.face_b);
  };
  return key(x) < key(y);
}

inline std::vector<Contact> sorted(std::vector<Contact> contacts) {
  std::sort(contacts.begin(), contacts.end(), comes_before);
  return contacts;
}

/// Every two instances, in either order, and with `selves` each with itself.
inline std::vector<ObjectPair> all_pairs(const std::vector<Instance>& instances, bool selves,
                                         RandomPoses& random) {
  std::vector<ObjectPair> pairs;
  const auto count = static_cast<std::uint32_t>(instances.size());
  for (std::uint32_t a = 0; a < count; ++a) {
    for (std::uint32_t b = selves ? a : a + 1; b < count; ++b) {
      pairs.push_back(random.below(2) == 0 ? ObjectPair{a, b} : ObjectPair{b, a});
    }
  }
  return pairs;
}

/// A scene, all of it in GPU memory, and its object pairs.
class GpuScene {
 public:
  GpuScene(const SampleAssets& assets, const std::vector<Instance>& instances,
           const std::vector<ObjectPair>& pairs, Contents contents = Contents::all)
      : GpuScene(assets.views(), instances, pairs, contents) {}
  GpuScene(std::span<const AssetView> files, const std::vector<Instance>& instances,
           const std::vector<ObjectPair>& pairs, Contents contents = Contents::all)
      : asset_(on_gpu(part(instances, &Instance::asset))),
        pose_(on_gpu(part(instances, &Instance::pose))),
        pairs_(on_gpu(pairs)),
        count_(on_gpu(std::vector<std::uint32_t>{static_cast<std::uint32_t>(pairs.size())})),
        instance_count_(static_cast<std::uint32_t>(instances.size())),
        pair_count_(static_cast<std::uint32_t>(pairs.size())) {
    EXPECT_EQ(uploaded_.upload(files, contents, nullptr), Status::kOk);
    for (std::size_t i = 0; i < uploaded_.count(); ++i) {
      views_.push_back(gpu_asset(uploaded_.level(i), files[i]));
      for (std::uint32_t level = 0; level < files[i].levels.size(); ++level)
        levels_.push_back(gpu_asset(uploaded_.level(i, level), files[i], level));
    }
  }

  std::span<const GpuAsset> assets() const { return views_; }
  std::span<const GpuAsset> levels() const { return levels_; }  ///< asset by asset
  std::size_t asset_bytes() const { return uploaded_.bytes(); }
  GpuInstances instances() const { return {asset_.data(), pose_.data(), instance_count_}; }
  GpuPairs pairs() const { return {pairs_.data(), count_.data(), pair_count_}; }

 private:
  template <typename Value>
  static std::vector<Value> part(const std::vector<Instance>& instances, Value Instance::*member) {
    std::vector<Value> out;
    for (const Instance& instance : instances) out.push_back(instance.*member);
    return out;
  }

  DeviceAssets uploaded_;
  std::vector<GpuAsset> views_, levels_;
  GpuArray<std::uint32_t> asset_;
  GpuArray<Pose> pose_;
  GpuArray<ObjectPair> pairs_;
  GpuArray<std::uint32_t> count_;
  std::uint32_t instance_count_, pair_count_;
};

/// The bounds of a scene's assets in GPU memory.
class GpuBounds {
 public:
  explicit GpuBounds(const std::vector<AssetBounds>& bounds)
      : bounds_(on_gpu(bounds)), count_(static_cast<std::uint32_t>(bounds.size())) {}
  explicit GpuBounds(const SampleAssets& assets) : GpuBounds(bounds_of(assets)) {}
  GpuAssetBounds view() const { return {bounds_.data(), count_}; }

 private:
  static std::vector<AssetBounds> bounds_of(const SampleAssets& assets) {
    std::vector<AssetBounds> bounds;
    for (const AssetView& asset : assets.views()) bounds.push_back(asset_bounds(*asset.header));
    return bounds;
  }

  GpuArray<AssetBounds> bounds_;
  std::uint32_t count_;
};

/// A stream, and a call that was captured on it into a graph.
class GraphStream {
 public:
  GraphStream() { EXPECT_EQ(stream_.create(), cudaSuccess); }
  cudaStream_t get() const { return stream_.get(); }

  /// Captures what enqueue() queues on the stream; enqueue() returns a Status.
  template <typename Enqueue>
  void capture(const Enqueue& enqueue) {
    EXPECT_EQ(cudaDeviceSynchronize(),
              cudaSuccess);  // the stream does not wait for copies on the default one
    EXPECT_EQ(graph_.capture(get(), [&] { EXPECT_EQ(enqueue(), Status::kOk); }), cudaSuccess);
  }
  /// Launches the graph and waits for its end.
  void launch() const {
    EXPECT_EQ(graph_.launch(get()), cudaSuccess);
    EXPECT_EQ(stream_.wait(), cudaSuccess);
  }

 private:
  GpuStream stream_;
  GpuGraph graph_;
};

/// Holds what a contact query told, with the contacts sorted.
struct ContactAnswer {
  Status status;
  std::uint64_t where;
  std::vector<Contact> contacts;
  ContactCounters counters;
};

inline ContactAnswer ask_cpu(std::span<const AssetView> assets, const std::vector<Instance>& instances,
                             const std::vector<ObjectPair>& pairs, const ContactOptions& options = {}) {
  Asked<ContactQuery> query;
  EXPECT_EQ(query.set_assets(assets), Status::kOk);
  const Status status = query.find(instances, pairs, options);
  return {status, query.where(), sorted({query.rows().begin(), query.rows().end()}), query.counters()};
}
inline ContactAnswer ask_cpu(const BodyScene& scene, const std::vector<ObjectPair>& pairs,
                             const ContactOptions& options = {}) {
  return ask_cpu(scene.assets.views(), scene.instances, pairs, options);
}

/// A question about the object pairs of a scene on the GPU. Its asset list is the scene's.
template <typename Query>
struct AskedOnGpu {
  AskedOnGpu(const BodyScene& of, const std::vector<ObjectPair>& pairs, Contents contents = Contents::all,
             cudaStream_t stream = nullptr)
      : scene(of.assets, of.instances, pairs, contents) {
    EXPECT_EQ(query.set_assets(scene.assets(), stream), Status::kOk)
        << cudaGetErrorString(query.cuda_error());
  }

  /// arguments: what enqueue() takes behind instances and pairs.
  template <typename... Arguments>
  Status enqueue(cudaStream_t stream, const Arguments&... arguments) {
    return query.enqueue(scene.instances(), scene.pairs(), arguments..., stream);
  }
  /// Enqueues a call and waits for its end.
  template <typename... Arguments>
  void run(const Arguments&... arguments) {
    EXPECT_EQ(enqueue(nullptr, arguments...), Status::kOk);
    EXPECT_EQ(cudaStreamSynchronize(nullptr), cudaSuccess);
  }
  const auto& report() const { return query.report(); }

  GpuScene scene;
  Query query;
};

/// The question cannot do without what an upload of such contents leaves out.
template <typename Query>
void expect_needed(const BodyScene& of, Contents contents, Status status) {
  const GpuScene scene(of.assets, of.instances, {}, contents);
  Query query;
  EXPECT_EQ(query.set_assets(scene.assets(), nullptr), status);
}

/// A contact query about a scene on the GPU.
struct AskedContacts : AskedOnGpu<GpuContactQuery> {
  using AskedOnGpu::AskedOnGpu;

  Status find(const GpuContactOptions& options = {}, cudaStream_t stream = nullptr) {
    return query.find_contacts(scene.instances(), scene.pairs(), options, stream);
  }
  /// Returns the contacts as they lie in GPU memory.
  std::vector<Contact> stored() const { return download(query.contacts(), report().contacts); }
  std::vector<Contact> contacts() const { return sorted(stored()); }
};

inline ContactAnswer ask_gpu(const BodyScene& scene, const std::vector<ObjectPair>& pairs,
                             const GpuContactOptions& options) {
  AskedContacts gpu(scene, pairs);
  const Status status = gpu.find(options);
  EXPECT_EQ(gpu.query.cuda_error(), cudaSuccess) << cudaGetErrorString(gpu.query.cuda_error());
  return {status, gpu.report().where, gpu.contacts(), gpu.report().counters};
}

/// Checks that both found the same contacts in the same way, as far as that is promised.
inline void expect_equal(const ContactAnswer& gpu, const ContactAnswer& cpu, QueryMode mode) {
  ASSERT_EQ(gpu.status, cpu.status);
  EXPECT_TRUE(cpu.status == Status::kOk || gpu.where == cpu.where) << gpu.where << ", not " << cpu.where;
  ASSERT_EQ(gpu.contacts.size(), cpu.contacts.size());
  EXPECT_EQ(gpu.contacts, cpu.contacts);
  EXPECT_EQ(gpu.counters.contacts, cpu.counters.contacts);
  EXPECT_EQ(gpu.counters.object_pairs, cpu.counters.object_pairs);
  if (mode == QueryMode::exact) return;  // other blocks are walked, and operations fused
  EXPECT_EQ(gpu.counters.block_pairs, cpu.counters.block_pairs);
  EXPECT_EQ(gpu.counters.candidates, cpu.counters.candidates);
  EXPECT_EQ(gpu.counters.decided_by_float32, cpu.counters.decided_by_float32);
}

/// Checks that there is a contact, and one alone, of each pair that has any. all: sorted.
inline void expect_one_of_each_pair(const std::vector<Contact>& first, const std::vector<Contact>& all) {
  std::map<std::uint32_t, int> wanted, found;
  for (const Contact& contact : all) wanted[contact.pair] = 1;
  for (const Contact& contact : first) {
    ++found[contact.pair];
    EXPECT_TRUE(std::binary_search(all.begin(), all.end(), contact, comes_before));
  }
  EXPECT_EQ(found, wanted);
}

/// Room for 50 contacts of four pairs, which have more, is too little, and none was reserved for such options
/// at first.
inline void expect_what_fits(AskedContacts& gpu, const GpuContactOptions& options) {
  ASSERT_EQ(gpu.query.reserve({4, 50, 100}), Status::kOk);
  EXPECT_EQ(gpu.enqueue(nullptr, options), Status::kOutOfRange);
  ASSERT_EQ(gpu.query.reserve({4, 50, 100}, options), Status::kOk);
  gpu.run(options);
  EXPECT_EQ(gpu.report().complete, 0u);
}

/// The query says of another scene of its assets that a pose is not rigid.
inline void expect_not_rigid(AskedContacts& gpu, const BodyScene& scene, const std::vector<ObjectPair>& pairs,
                             const GpuContactOptions& options) {
  const GpuScene wrong(scene.assets, scene.instances, pairs);
  EXPECT_EQ(gpu.query.find_contacts(wrong.instances(), wrong.pairs(), options, nullptr),
            Status::kPoseNotRigid);
}

/// Bodies at random places, close enough to meet.
inline BodyScene pile(std::uint32_t bodies, std::uint32_t triangles, double spread, std::uint64_t seed) {
  RandomPoses random(seed);
  BodyScene scene;
  scene.assets.add(soup(random, triangles, 0.1));
  scene.assets.add(cube(0.5f, 12));
  for (std::uint32_t i = 0; i < bodies; ++i) {
    scene.instances.push_back({i % 2, random.pose({1, 1, spread, 0, 4})});
  }
  return scene;
}

}  // namespace tandem::test
