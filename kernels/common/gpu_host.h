#pragma once
#include <algorithm>
#include <new>
#include <span>

#include "kernels/common/gpu_room.h"
#include "kernels/common/launch.h"
#include "tandem/formats/gpu_status.h"
#include "tandem/kernels/gpu_question.h"

// The CPU's side of a question on a GPU, as far as it is the same for all of them.
namespace tandem::gpu {

/// Says what the assets of a list have, all together.
struct AssetSummary {
  std::uint32_t depth = 1;                    ///< of the deepest tree
  std::uint32_t blocks = 0, triangles = 0;    ///< of the largest
  std::uint64_t faces = 0;                    ///< the most source faces of one
  bool axis_aligned = true, oriented = true;  ///< whether each has these blocks
  bool topology = true;                       ///< and this
};

inline AssetSummary summary_of(std::span<const GpuAsset> assets) {
  AssetSummary all;
  for (const GpuAsset& asset : assets) {
    all.depth = std::max(all.depth, asset.tree.depth);
    all.blocks = std::max(all.blocks, asset.tree.block_count);
    all.triangles = std::max(all.triangles, asset.tree.triangle_count);
    all.faces = std::max(all.faces, asset.source_faces);
    all.axis_aligned = all.axis_aligned && asset.tree.blocks != nullptr;
    all.oriented = all.oriented && asset.tree.oriented_blocks != nullptr;
    all.topology = all.topology && asset.tree.topology != nullptr;
  }
  return all;
}

/// Calls functions of a kernel's arguments and the stream in their order until one of them fails.
template <typename Args, typename... Steps>
cudaError_t queue(const Args& args, cudaStream_t stream, const Steps&... steps) {
  cudaError_t error = cudaSuccess;
  static_cast<void>((((error = steps(args, stream)) == cudaSuccess) && ...));
  return error;
}

/// The memory of a question. State: what its kernels share, with the report in it.
template <typename State, typename Report>
struct GpuHost : Memory {
  DeviceLimits limits = {};
  RoomArray<State> state{*this};
  PinnedArray<Report> report;
  cudaError_t error = cudaSuccess;

  const Report* device_report() const { return &state->report; }

  /// Keeps what CUDA says of a call.
  Status keep(cudaError_t result) {
    error = result;
    if (result != cudaSuccess) static_cast<void>(cudaGetLastError());  // later calls must not report it again
    return status_of(result);
  }

  /// Keeps what CUDA said of a call of another question.
  template <typename Question>
  Status keep(Status status, const Question& other) {
    error = other.cuda_error();
    return status;
  }

  /// Provides what does not depend on the capacity, once. more(): what the question has besides.
  template <typename More>
  Status provide_fixed_memory(const More& more) {
    if (report.data() != nullptr) return Status::kOk;
    Status status = keep(limits_of_device(limits));
    if (status == Status::kOk) status = keep(state.reserve(1));
    if (status == Status::kOk) status = more();
    if (status != Status::kOk) return status;
    status = keep(report.reserve(1));
    if (status == Status::kOk) *report = {};
    return status == Status::kOutOfGpuMemory ? Status::kOutOfMemory : status;
  }
  Status provide_fixed_memory() {
    return provide_fixed_memory([] { return Status::kOk; });
  }

  /// Writes what the arguments of all kernels of a question have, and where its arrays lie.
  template <typename Args>
  void fill(Args& args, const GpuInstances& instances) const {
    name_arrays(args);
    args.instances = instances;
    args.state = state.data();
    args.host_report = report.data();
    args.limits = limits;
  }
};

/// The list of assets as kernels take it.
struct AssetList {
  RoomArray<GpuAsset> list;
  const GpuAsset* records = nullptr;  // to follow, instead of the list
  AssetSummary all = {};
  std::uint32_t count = 0;

  explicit AssetList(Memory& memory) : list(memory) {}

  /// Uploads the list and waits for that. After an error there are no assets.
  template <typename Host>
  Status set(std::span<const GpuAsset> assets, const AssetSummary& summary, Host& host, cudaStream_t stream) {
    count = 0;
    records = nullptr;
    if (assets.size() >= kNoIndex) return Status::kOutOfRange;
    Status status = host.keep(list.upload(assets, stream));
    if (status == Status::kOk) status = host.keep(cudaStreamSynchronize(stream));
    if (status != Status::kOk) return status;
    all = summary;
    count = static_cast<std::uint32_t>(assets.size());
    return status;
  }

  template <typename Args>
  void fill(Args& args) const {
    args.assets = records != nullptr ? records : list.data();
    args.asset_count = count;
  }
};

/// Enqueues a call and waits for it until it is complete. wanted: the first room. enqueue(): a Status.
/// next(report, wanted): the room for another turn, or why more room would not help.
template <typename Host, typename Capacity, typename Options, typename Enqueue, typename Next>
Status find_until_complete(Host& host, Capacity wanted, const Options& options, cudaStream_t stream,
                           const Enqueue& enqueue, const Next& next) {
  for (;;) {
    Status status = host.reserve(wanted, options);
    if (status == Status::kOk) status = enqueue();
    if (status == Status::kOk) status = host.keep(cudaStreamSynchronize(stream));
    if (status == Status::kOk) status = host.report->status;
    if (status != Status::kOk || host.report->complete != 0) return status;
    status = next(*host.report, wanted);
    if (status != Status::kOk) return status;
  }
}

/// Enqueues, as find_until_complete() does, what is made of a contact query that has ended. If that query is
/// not complete, more room does not help.
template <typename Host, typename Capacity, typename Options, typename Query, typename Enqueue>
Status find_behind(const Query& query, Host& host, const Capacity& wanted, const Options& options,
                   cudaStream_t stream, const Enqueue& enqueue) {
  return find_until_complete(host, wanted, options, stream, enqueue, [&](const auto& report, Capacity& more) {
    more = report.needed;
    return query.report().complete != 0 ? Status::kOk : Status::kOutOfRange;
  });
}

}  // namespace tandem::gpu

namespace tandem {

template <typename Capacity, typename Report, typename Options>
GpuQuestion<Capacity, Report, Options>::GpuQuestion() : host_(new (std::nothrow) gpu::HostOf<Report>) {}
template <typename Capacity, typename Report, typename Options>
GpuQuestion<Capacity, Report, Options>::GpuQuestion(GpuQuestion&&) noexcept = default;
template <typename Capacity, typename Report, typename Options>
GpuQuestion<Capacity, Report, Options>& GpuQuestion<Capacity, Report, Options>::operator=(
    GpuQuestion&&) noexcept = default;
template <typename Capacity, typename Report, typename Options>
GpuQuestion<Capacity, Report, Options>::~GpuQuestion() = default;

template <typename Capacity, typename Report, typename Options>
Status GpuQuestion<Capacity, Report, Options>::reserve(const Capacity& wanted, const Options& options) {
  return host_ != nullptr ? host_->reserve(wanted, options) : Status::kOutOfMemory;
}

template <typename Capacity, typename Report, typename Options>
const Report* GpuQuestion<Capacity, Report, Options>::device_report() const {
  return host_->device_report();
}

template <typename Capacity, typename Report, typename Options>
const Report& GpuQuestion<Capacity, Report, Options>::report() const {
  return *host_->report;
}

template <typename Capacity, typename Report, typename Options>
Capacity GpuQuestion<Capacity, Report, Options>::capacity() const {
  return host_ != nullptr ? host_->capacity() : Capacity{};
}

template <typename Capacity, typename Report, typename Options>
std::size_t GpuQuestion<Capacity, Report, Options>::bytes() const {
  return host_ != nullptr ? host_->bytes() : 0;
}

template <typename Capacity, typename Report, typename Options>
cudaError_t GpuQuestion<Capacity, Report, Options>::cuda_error() const {
  return host_ != nullptr ? host_->error : cudaSuccess;
}

template <typename Capacity, typename Report, typename Options>
Status GpuAssetQuestion<Capacity, Report, Options>::set_assets(std::span<const GpuAsset> assets,
                                                               cudaStream_t stream) {
  return this->host_ != nullptr ? this->host_->set_assets(assets, stream) : Status::kOutOfMemory;
}

template <typename Capacity, typename Report, typename Options>
Status GpuAssetQuestion<Capacity, Report, Options>::follow(const GpuAssetRecords& records) {
  return this->host_ != nullptr ? this->host_->follow(records) : Status::kOutOfMemory;
}

}  // namespace tandem
