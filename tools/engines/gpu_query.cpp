#include "gpu_query.h"

#include <cuda_runtime_api.h>

#include <algorithm>
#include <chrono>
#include <new>
#include <numeric>
#include <stdexcept>
#include <tuple>

#include "engines/paper/paper_engine.h"
#include "tandem/formats/gpu_status.h"
#include "tandem/kernels/gpu_broad_phase.h"
#include "tandem/kernels/gpu_contact_query.h"
#include "tandem/runtime/upload.h"

namespace tandem::bench {
namespace {

std::string free_memory() {
  std::size_t free = 0, total = 0;
  if (cudaMemGetInfo(&free, &total) != cudaSuccess) return {};
  return ": " + std::to_string(free >> 20) + " of " + std::to_string(total >> 20) + " MiB are free";
}

std::string version(int number) {
  return std::to_string(number / 1000) + "." + std::to_string(number % 1000 / 10);
}

// CUDA calls a driver that is missing too old.
std::string driver_defect() {
  int driver = 0, runtime = 0;
  if (cudaDriverGetVersion(&driver) != cudaSuccess || driver == 0) return "no NVIDIA driver is installed";
  static_cast<void>(cudaRuntimeGetVersion(&runtime));
  return "it is for CUDA " + version(driver) + ", the program for CUDA " + version(runtime);
}

// Of a status that is not about the scene.
[[noreturn]] void fail(Status status, cudaError_t error, const char* what) {
  const std::string reason =
      error == cudaErrorInsufficientDriver ? driver_defect() : cudaGetErrorString(error);
  switch (status) {
    case Status::kOutOfMemory:
      throw std::bad_alloc();
    case Status::kOutOfGpuMemory:
      throw GpuError(std::string("--backend cuda: ") + what + ": " + explain(status) + free_memory());
    case Status::kNoGpu:
    case Status::kDriverTooOld:
    case Status::kGpuNotSupported:
      throw GpuError(std::string("--backend cuda: ") + explain(status) + ": " + reason);
    default:
      throw std::runtime_error(std::string("the GPU: ") + what + ": " + reason);
  }
}

void require(cudaError_t error, const char* what) {
  if (error != cudaSuccess) fail(status_of(error), error, what);
}

void require(Status status, cudaError_t error, const char* what) {
  if (status != Status::kOk) fail(status, error, what);
}

std::size_t free_bytes() {
  std::size_t free = 0, total = 0;
  require(cudaMemGetInfo(&free, &total), "memory");
  return free;
}

// An array in GPU memory.
template <typename Element>
class GpuArray {
 public:
  GpuArray(const std::vector<Element>& host, cudaStream_t stream) : size_(host.size()) {
    void* memory = nullptr;
    require(cudaMalloc(&memory, std::max<std::size_t>(bytes(), 1)), "instances");
    data_ = static_cast<Element*>(memory);
    require(cudaMemcpyAsync(data_, host.data(), bytes(), cudaMemcpyHostToDevice, stream), "instances");
  }
  GpuArray(const GpuArray&) = delete;
  GpuArray& operator=(const GpuArray&) = delete;
  ~GpuArray() { static_cast<void>(cudaFree(data_)); }

  const Element* data() const { return data_; }
  std::uint32_t size() const { return static_cast<std::uint32_t>(size_); }
  std::size_t bytes() const { return size_ * sizeof(Element); }

 private:
  Element* data_ = nullptr;
  std::size_t size_;
};

template <typename Element>
std::vector<Element> download(const Element* data, std::size_t count) {
  std::vector<Element> host(count);
  require(cudaMemcpy(host.data(), data, count * sizeof(Element), cudaMemcpyDeviceToHost), "download");
  return host;
}

struct Stream {
  cudaStream_t handle = nullptr;
  Stream() { require(cudaStreamCreateWithFlags(&handle, cudaStreamNonBlocking), "a stream"); }
  Stream(const Stream&) = delete;
  Stream& operator=(const Stream&) = delete;
  ~Stream() { static_cast<void>(cudaStreamDestroy(handle)); }
};

struct Event {
  cudaEvent_t handle = nullptr;
  Event() { require(cudaEventCreate(&handle), "an event"); }
  Event(const Event&) = delete;
  Event& operator=(const Event&) = delete;
  ~Event() { static_cast<void>(cudaEventDestroy(handle)); }
};

double seconds_between(const Event& begin, const Event& end) {
  float milliseconds = 0;
  require(cudaEventElapsedTime(&milliseconds, begin.handle, end.handle), "time");
  return 1e-3 * static_cast<double>(milliseconds);
}

// What `enqueue` queues on the stream, to be run again and again.
class Graph {
 public:
  template <typename Enqueue>
  Graph(cudaStream_t stream, const Enqueue& enqueue) {
    require(cudaStreamBeginCapture(stream, cudaStreamCaptureModeThreadLocal), "a graph");
    enqueue();
    cudaGraph_t graph = nullptr;
    require(cudaStreamEndCapture(stream, &graph), "a graph");
    const cudaError_t error = cudaGraphInstantiate(&handle_, graph, 0);
    static_cast<void>(cudaGraphDestroy(graph));
    require(error, "a graph");
  }
  Graph(const Graph&) = delete;
  Graph& operator=(const Graph&) = delete;
  ~Graph() { static_cast<void>(cudaGraphExecDestroy(handle_)); }

  void launch(cudaStream_t stream) const { require(cudaGraphLaunch(handle_, stream), "a graph"); }

 private:
  cudaGraphExec_t handle_ = nullptr;
};

std::vector<DeviceAsset> upload(const Scene& scene, cudaStream_t stream) {
  std::vector<DeviceAsset> assets;
  for (const AssetView& view : scene.views()) {
    DeviceAsset& asset = assets.emplace_back();
    const Status status = asset.upload(view, stream);
    require(status, asset.cuda_error(), "an asset");
  }
  return assets;
}

template <typename Out, typename Make>
std::vector<Out> list(std::size_t count, const Make& make) {
  std::vector<Out> out;
  out.reserve(count);
  for (std::size_t i = 0; i < count; ++i) out.push_back(make(i));
  return out;
}

// A scene in GPU memory.
class GpuScene {
 public:
  GpuScene(const Scene& scene, const std::vector<ObjectPair>& pairs, cudaStream_t stream)
      : uploads_(upload(scene, stream)),
        asset_(
            list<std::uint32_t>(count(scene), [&](auto i) { return scene.description.instances[i].asset; }),
            stream),
        pose_(list<Pose>(count(scene), [&](auto i) { return scene.description.instances[i].pose; }), stream),
        bounds_(
            list<AssetBounds>(scene.assets.size(), [&](auto i) { return asset_bounds(*header(scene, i)); }),
            stream),
        pairs_(pairs, stream),
        pair_count_({static_cast<std::uint32_t>(pairs.size())}, stream) {
    for (std::size_t i = 0; i < uploads_.size(); ++i) {
      views_.push_back(gpu_asset(uploads_[i].level(), *header(scene, i)));
    }
    require(cudaStreamSynchronize(stream), "upload");
  }

  std::span<const GpuAsset> assets() const { return views_; }
  GpuInstances instances() const { return {asset_.data(), pose_.data(), asset_.size()}; }
  GpuAssetBounds bounds() const { return {bounds_.data(), bounds_.size()}; }
  GpuPairs given_pairs() const { return {pairs_.data(), pair_count_.data(), pairs_.size()}; }

  std::size_t bytes() const {
    const std::size_t arrays = asset_.bytes() + pose_.bytes() + bounds_.bytes() + pairs_.bytes();
    return std::accumulate(uploads_.begin(), uploads_.end(), arrays,
                           [](std::size_t sum, const DeviceAsset& asset) { return sum + asset.bytes(); });
  }

 private:
  static std::size_t count(const Scene& scene) { return scene.description.instances.size(); }
  static const FileHeader* header(const Scene& scene, std::size_t i) { return scene.assets[i].view().header; }

  std::vector<DeviceAsset> uploads_;
  std::vector<GpuAsset> views_;
  GpuArray<std::uint32_t> asset_;
  GpuArray<Pose> pose_;
  GpuArray<AssetBounds> bounds_;
  GpuArray<ObjectPair> pairs_;
  GpuArray<std::uint32_t> pair_count_;
};

// The object pairs of a scene: given, or found on the GPU.
class PairsStep {
 public:
  PairsStep(const GpuScene& scene, bool given, bool sorted, cudaStream_t stream)
      : scene_(scene), given_(given), options_{sorted}, stream_(stream) {}

  // Until there is room for all.
  void settle(const std::string& path) {
    if (given_) return;
    const Status status = broad_.find_pairs(scene_.instances(), scene_.bounds(), options_, stream_);
    if (subject(status) != nullptr) refuse(path, status, broad_.report().where);
    if (status == Status::kTooManyPairs) refuse(path, status, 0);
    require(status, broad_.cuda_error(), "broad phase");
  }

  void enqueue() {
    if (given_) return;
    const Status status = broad_.enqueue(scene_.instances(), scene_.bounds(), options_, stream_);
    require(status, broad_.cuda_error(), "broad phase");
  }

  GpuPairs pairs() const { return given_ ? scene_.given_pairs() : broad_.pairs(); }
  std::vector<ObjectPair> read() const {
    return download(pairs().pairs, given_ ? pairs().capacity : broad_.report().count);
  }
  std::size_t bytes() const { return broad_.bytes(); }
  std::size_t bytes_bound() const {
    return given_ ? 0 : most_broad_phase_bytes(broad_.capacity(), options_.sorted);
  }

 private:
  const GpuScene& scene_;
  bool given_;
  GpuBroadPhaseOptions options_;
  cudaStream_t stream_;
  GpuBroadPhase broad_;
};

// A query, and what it is timed with.
struct Setting {
  const std::string& path;
  const GpuScene& scene;
  PairsStep& pairs;
  const GpuQueryRequest& request;
  cudaStream_t stream;
  bool given;
  std::size_t free_before;  // bytes of GPU memory, before anything was uploaded
};

// Times what `run` queues, which records the event between the two steps.
template <typename Run>
void time_repeats(const Setting& setting, const Event& between, const Run& run, GpuAnswer& answer) {
  const Event begin, end;
  for (std::uint32_t i = 0; i < setting.request.repeats; ++i) {
    require(cudaEventRecord(begin.handle, setting.stream), "an event");
    run();
    require(cudaEventRecord(end.handle, setting.stream), "an event");
    require(cudaStreamSynchronize(setting.stream), "the query");
    answer.whole.push_back(seconds_between(begin, end));
    answer.narrow.push_back(seconds_between(setting.given ? begin : between, end));
    if (!setting.given) answer.broad_phase.push_back(seconds_between(begin, between));
  }
}

// The walk of both trees without candidates.
void time_traversal(const Setting& setting, GpuAnswer& answer) {
  const GpuQueryOptions options = {.walk_only = true};
  GpuContactQuery query;
  require(query.set_assets(setting.scene.assets(), setting.stream), query.cuda_error(), "assets");
  require(query.reserve({.pairs = static_cast<std::uint32_t>(answer.counters.object_pairs)}, options),
          query.cuda_error(), "traversal");
  const Graph graph(setting.stream, [&] {
    const Status status =
        query.enqueue(setting.scene.instances(), setting.pairs.pairs(), options, setting.stream);
    require(status, query.cuda_error(), "traversal");
  });
  const Event begin, end;
  for (std::uint32_t i = 0; i < setting.request.repeats; ++i) {
    require(cudaEventRecord(begin.handle, setting.stream), "an event");
    graph.launch(setting.stream);
    require(cudaEventRecord(end.handle, setting.stream), "an event");
    require(cudaStreamSynchronize(setting.stream), "traversal");
    answer.traversal.push_back(seconds_between(begin, end));
  }
}

// Of what the GPU was to sort.
void check_order(const std::vector<Contact>& contacts) {
  const auto key = [](const Contact& c) {
    return std::tie(c.pair, c.face_a, c.face_b, c.triangle_a, c.triangle_b);
  };
  const auto after = [&](const Contact& x, const Contact& y) { return key(x) >= key(y); };
  if (std::adjacent_find(contacts.begin(), contacts.end(), after) == contacts.end()) return;
  throw std::runtime_error("the GPU: its contacts are not sorted");
}

void ask_tandem(const Setting& setting, GpuAnswer& answer) {
  const GpuInstances instances = setting.scene.instances();
  const GpuQueryOptions options = {setting.request.mode, setting.request.first_contact_only,
                                   setting.request.sorted};
  GpuContactQuery query;
  Status status = query.set_assets(setting.scene.assets(), setting.stream);
  require(status, query.cuda_error(), "assets");
  status = query.find_contacts(instances, setting.pairs.pairs(), options, setting.stream);
  if (subject(status) != nullptr) refuse(setting.path, status, query.report().where);
  require(status, query.cuda_error(), "contacts");
  const Event between;
  const Graph graph(setting.stream, [&] {
    setting.pairs.enqueue();
    require(cudaEventRecordWithFlags(between.handle, setting.stream, cudaEventRecordExternal), "an event");
    status = query.enqueue(instances, setting.pairs.pairs(), options, setting.stream);
    require(status, query.cuda_error(), "contacts");
  });
  time_repeats(
      setting, between, [&] { graph.launch(setting.stream); }, answer);
  if (query.report().status != Status::kOk || query.report().complete == 0) {
    throw std::runtime_error("the GPU: a repeat of the query found something else than the first");
  }
  answer.counters = query.report().counters;
  answer.bytes += query.bytes();
  answer.bytes_bound = most_query_bytes(query.capacity(), options.sorted, setting.scene.assets());
  answer.bytes_taken = setting.free_before - free_bytes();
  answer.contacts = download(query.contacts(), query.report().contacts);
  if (options.sorted) check_order(answer.contacts);
  if (setting.request.traversal) time_traversal(setting, answer);
}

void ask_paper(const Setting& setting, GpuAnswer& answer) {
  PaperOptions options;
  options.mode = setting.request.mode;
  options.flags = setting.request.engine == GpuEngine::paper_bits ? PaperFlags::bits : PaperFlags::words;
  PaperEngine query;
  require(query.set_assets(setting.scene.assets(), setting.stream), query.cuda_error(), "assets");
  const auto find = [&] {
    const Status status =
        query.find_contacts(setting.scene.instances(), setting.pairs.pairs(), options, setting.stream);
    if (subject(status) != nullptr) refuse(setting.path, status, query.report().where);
    require(status, query.cuda_error(), "contacts");
  };
  find();
  const Event between;
  const auto run = [&] {
    setting.pairs.enqueue();
    require(cudaEventRecord(between.handle, setting.stream), "an event");
    find();
  };
  time_repeats(setting, between, run, answer);
  answer.counters = query.report().counters;
  answer.bytes += query.bytes();
  answer.bytes_taken = setting.free_before - free_bytes();
  answer.contacts = download(query.contacts(), query.report().counters.contacts);
}

// Pairs in ascending order, and the contacts' rows with them.
void sort_pairs(GpuAnswer& answer) {
  const auto key = [&](std::uint32_t i) { return std::tie(answer.pairs[i].a, answer.pairs[i].b); };
  std::vector<std::uint32_t> order(answer.pairs.size()), row(answer.pairs.size());
  std::iota(order.begin(), order.end(), 0u);
  std::sort(order.begin(), order.end(), [&](auto x, auto y) { return key(x) < key(y); });
  for (std::uint32_t i = 0; i < order.size(); ++i) row[order[i]] = i;
  answer.pairs = list<ObjectPair>(order.size(), [&](auto i) { return answer.pairs[order[i]]; });
  for (Contact& contact : answer.contacts) contact.pair = row[contact.pair];
}

// Makes the context, so that upload is not charged with it.
std::string start_gpu() {
  int device = 0;
  cudaDeviceProp properties;
  require(cudaFree(nullptr), "start");
  require(cudaGetDevice(&device), "start");
  require(cudaGetDeviceProperties(&properties, device), "start");
  return properties.name;
}

}  // namespace

GpuAnswer query_on_gpu(const std::string& path, const Scene& scene, const std::vector<ObjectPair>* given,
                       const GpuQueryRequest& request) {
  GpuAnswer answer;
  answer.gpu = start_gpu();
  const std::size_t free_before = free_bytes();
  const Stream stream;
  const auto start = std::chrono::steady_clock::now();
  const GpuScene on_gpu(scene, given != nullptr ? *given : std::vector<ObjectPair>(), stream.handle);
  answer.upload = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  PairsStep pairs(on_gpu, given != nullptr, request.sorted, stream.handle);
  pairs.settle(path);
  const auto ask = request.engine == GpuEngine::tandem ? ask_tandem : ask_paper;
  ask({path, on_gpu, pairs, request, stream.handle, given != nullptr, free_before}, answer);
  answer.pairs = pairs.read();
  answer.bytes += on_gpu.bytes() + pairs.bytes();
  if (answer.bytes_bound != 0) answer.bytes_bound += on_gpu.bytes() + pairs.bytes_bound();
  sort_pairs(answer);
  return answer;
}

}  // namespace tandem::bench
