#include <cuda_runtime_api.h>

#include <algorithm>
#include <string>

#include "engine_parts.h"
#include "engines/paper/paper_engine.h"
#include "gpu_query.h"
#include "tandem/formats/gpu_status.h"
#include "tandem/kernels/gpu_broad_phase.h"
#include "tandem/kernels/gpu_contact_query.h"
#include "tandem/runtime/upload.h"

namespace tandem::simulation {
namespace {

void check(std::string_view engine, Status status, cudaError_t error) {
  if (status == Status::kOk) return;
  if (status == Status::kOutOfMemory) throw std::bad_alloc();
  const std::string reason = error == cudaSuccess ? "" : std::string(": ") + cudaGetErrorString(error);
  throw bench::GpuError(std::string(engine) + ": " + explain(status) + reason);
}

void check(std::string_view engine, cudaError_t error) {
  check(engine, status_of(error), error);
}

struct Stream {
  cudaStream_t handle = nullptr;

  explicit Stream(std::string_view engine) {
    check(engine, cudaStreamCreateWithFlags(&handle, cudaStreamNonBlocking));
  }
  Stream(const Stream&) = delete;
  Stream& operator=(const Stream&) = delete;
  ~Stream() { static_cast<void>(cudaStreamDestroy(handle)); }
};

// An array on the GPU and one in pinned memory of the CPU, which grow together.
template <typename Element>
class SharedArray {
 public:
  SharedArray() = default;
  SharedArray(const SharedArray&) = delete;
  SharedArray& operator=(const SharedArray&) = delete;
  ~SharedArray() { free(); }

  cudaError_t reserve(std::size_t size) {
    if (size <= room_ && host_ != nullptr) return cudaSuccess;
    free();
    const std::size_t room = size + size / 2 + 16;
    if (const cudaError_t error = cudaMalloc(reinterpret_cast<void**>(&device_), room * sizeof(Element))) {
      return error;
    }
    const cudaError_t error = cudaMallocHost(reinterpret_cast<void**>(&host_), room * sizeof(Element));
    if (error == cudaSuccess) room_ = room;
    return error;
  }
  cudaError_t upload(std::size_t count, cudaStream_t stream) {
    return cudaMemcpyAsync(device_, host_, count * sizeof(Element), cudaMemcpyHostToDevice, stream);
  }
  cudaError_t download(const Element* from, std::size_t count, cudaStream_t stream) {
    const cudaError_t error =
        cudaMemcpyAsync(host_, from, count * sizeof(Element), cudaMemcpyDeviceToHost, stream);
    return error == cudaSuccess ? cudaStreamSynchronize(stream) : error;
  }
  Element* host() { return host_; }
  const Element* device() const { return device_; }

 private:
  void free() {
    static_cast<void>(cudaFree(device_));
    static_cast<void>(cudaFreeHost(host_));
    device_ = host_ = nullptr;
    room_ = 0;
  }
  Element *device_ = nullptr, *host_ = nullptr;
  std::size_t room_ = 0;
};

// Tandem's query or the paper's scheme, behind the same broad phase.
class GpuEngine final : public CollisionEngine {
 public:
  GpuEngine(std::string_view name, const EngineOptions& options)
      : name_(name), mode_(options.fast ? QueryMode::fast : QueryMode::exact), stream_(name) {}

  std::string_view name() const override { return name_; }

  void set_shapes(std::span<const AssetView> shapes) override {
    uploads_.clear();
    require_cuda(bounds_.reserve(shapes.size()));
    std::vector<GpuAsset> views;
    for (std::size_t i = 0; i < shapes.size(); ++i) {
      DeviceAsset& upload = uploads_.emplace_back();
      const Status status = upload.upload(shapes[i], stream_.handle);
      check(name_, status, upload.cuda_error());
      views.push_back(gpu_asset(upload.level(), *shapes[i].header));
      bounds_.host()[i] = asset_bounds(*shapes[i].header);
    }
    require_cuda(bounds_.upload(shapes.size(), stream_.handle));
    require_cuda(cudaStreamSynchronize(stream_.handle));
    if (is_paper()) {
      const Status status = paper_.set_assets(views, stream_.handle);
      check(name_, status, paper_.cuda_error());
    } else {
      const Status status = query_.set_assets(views, stream_.handle);
      check(name_, status, query_.cuda_error());
    }
  }

  void find(std::span<const BodyPose> bodies, std::span<const std::uint8_t> idle,
            ContactList& found) override {
    times_ = {};
    counters_ = {};
    Stopwatch watch;
    upload(bodies);
    times_.update = watch.lap();
    const GpuPairs pairs = find_pairs(static_cast<std::uint32_t>(bodies.size()), idle, found.pairs);
    times_.broad_phase = watch.lap();
    const Contact* contacts = is_paper() ? ask_paper(pairs) : ask_tandem(pairs);
    times_.traversal = watch.lap() - times_.triangle_tests;
    take(contacts, found);
    times_.transfer = watch.lap();
    counters_.object_pairs = found.pairs.size();
  }

 private:
  bool is_paper() const { return name_ != "tandem-cuda"; }
  void require_cuda(cudaError_t error) const { check(name_, error); }

  // Of a status that may be about a body.
  void require_status(Status status, std::uint64_t where, cudaError_t error) const {
    if (subject(status) != nullptr) require(name_, status, where);
    check(name_, status, error);
  }

  void upload(std::span<const BodyPose> bodies) {
    require_cuda(shape_of_.reserve(bodies.size()));
    require_cuda(poses_.reserve(bodies.size()));
    for (std::size_t i = 0; i < bodies.size(); ++i) {
      shape_of_.host()[i] = bodies[i].asset;
      poses_.host()[i] = bodies[i].pose;
    }
    require_cuda(shape_of_.upload(bodies.size(), stream_.handle));
    require_cuda(poses_.upload(bodies.size(), stream_.handle));
    require_cuda(cudaStreamSynchronize(stream_.handle));
    instances_ = {shape_of_.device(), poses_.device(), static_cast<std::uint32_t>(bodies.size())};
  }

  // The pairs on the CPU, sorted, and where they lie on the GPU: without those of idle bodies.
  GpuPairs find_pairs(std::uint32_t bodies, std::span<const std::uint8_t> idle,
                      std::vector<ObjectPair>& pairs) {
    const GpuAssetBounds bounds = {bounds_.device(), static_cast<std::uint32_t>(uploads_.size())};
    if (bodies == 0) require_cuda(pairs_.reserve(1));
    const Status status = broad_.find_pairs(instances_, bounds, {.sorted = true}, stream_.handle);
    require_status(status, status == Status::kOk ? 0 : broad_.report().where, broad_.cuda_error());
    const std::uint32_t count = broad_.report().count;
    require_cuda(pairs_.reserve(count));
    require_cuda(pairs_.download(broad_.pairs().pairs, count, stream_.handle));
    keep_active(std::span(pairs_.host(), count), idle, pairs);
    if (pairs.size() == count) return broad_.pairs();
    require_cuda(pair_count_.reserve(1));
    std::copy(pairs.begin(), pairs.end(), pairs_.host());
    *pair_count_.host() = static_cast<std::uint32_t>(pairs.size());
    require_cuda(pairs_.upload(pairs.size(), stream_.handle));
    require_cuda(pair_count_.upload(1, stream_.handle));
    return {pairs_.device(), pair_count_.device(), static_cast<std::uint32_t>(pairs.size())};
  }

  const Contact* ask_tandem(const GpuPairs& pairs) {
    const Status status = query_.find_contacts(instances_, pairs, {.mode = mode_}, stream_.handle);
    require_status(status, status == Status::kOk ? 0 : query_.report().where, query_.cuda_error());
    counters_ = query_.report().counters;
    counters_.contacts = query_.report().contacts;
    return query_.contacts();
  }

  const Contact* ask_paper(const GpuPairs& pairs) {
    bench::PaperOptions options;
    options.mode = mode_;
    options.flags = name_ == "paper-bits" ? bench::PaperFlags::bits : bench::PaperFlags::words;
    const Status status = paper_.find_contacts(instances_, pairs, options, stream_.handle);
    require_status(status, paper_.report().where, paper_.cuda_error());
    counters_ = paper_.report().counters;
    times_.triangle_tests = 1e-3 * static_cast<double>(paper_.report().triangle_ms);
    return paper_.contacts();
  }

  void take(const Contact* contacts, ContactList& found) {
    const std::size_t count = counters_.contacts;
    require_cuda(contacts_.reserve(count));
    require_cuda(contacts_.download(contacts, count, stream_.handle));
    found.triangles.resize(count);
    for (std::size_t i = 0; i < count; ++i) {
      const Contact& c = contacts_.host()[i];
      found.triangles[i] = {c.pair, c.triangle_a, c.triangle_b};
    }
    sort_contacts(found.triangles);
  }

  std::string name_;
  QueryMode mode_;
  Stream stream_;
  std::vector<DeviceAsset> uploads_;
  SharedArray<AssetBounds> bounds_;
  SharedArray<std::uint32_t> shape_of_, pair_count_;
  SharedArray<Pose> poses_;
  SharedArray<ObjectPair> pairs_;
  SharedArray<Contact> contacts_;
  GpuInstances instances_ = {};
  GpuBroadPhase broad_;
  GpuContactQuery query_;
  bench::PaperEngine paper_;
};

}  // namespace

std::unique_ptr<CollisionEngine> make_gpu_engine(std::string_view name, const EngineOptions& options) {
  return std::make_unique<GpuEngine>(name, options);
}

}  // namespace tandem::simulation
