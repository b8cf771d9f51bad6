#include "tandem/kernels/gpu_contact_query.h"

#include <algorithm>
#include <memory>
#include <new>
#include <utility>

#include "gpu_query_data.h"
#include "tandem/formats/gpu_status.h"

namespace tandem {
namespace {

// Walk blocks that an entry of the walk's stack can name.
constexpr std::uint64_t kMostNumbers = std::uint64_t{1} << gpu::kNumberBits;

// Entries of a warp's stack beyond its reserve.
constexpr std::uint32_t kStackSize = 208;

template <typename Number>
Number grown(Number wanted, Number present) {
  return wanted <= present ? present : std::max(wanted, present + present / 2);
}

// A candidate that lies beyond 32 bits could not be numbered.
constexpr std::uint64_t kMostUndecided = 0xFFFFFFFEu;

}  // namespace

GpuContactQuery& GpuContactQuery::operator=(GpuContactQuery&& other) noexcept {
  std::swap(assets_, other.assets_);
  std::swap(asset_count_, other.asset_count_);
  std::swap(asset_room_, other.asset_room_);
  std::swap(walk_blocks_, other.walk_blocks_);
  std::swap(file_blocks_, other.file_blocks_);
  std::swap(block_room_, other.block_room_);
  std::swap(depth_, other.depth_);
  std::swap(most_triangles_, other.most_triangles_);
  std::swap(most_faces_, other.most_faces_);
  std::swap(state_, other.state_);
  std::swap(state_is_clear_, other.state_is_clear_);
  std::swap(chunks_, other.chunks_);
  std::swap(pairs_, other.pairs_);
  std::swap(world_pairs_, other.world_pairs_);
  std::swap(met_, other.met_);
  std::swap(contacts_, other.contacts_);
  std::swap(undecided_, other.undecided_);
  std::swap(unsorted_, other.unsorted_);
  std::swap(order_, other.order_);
  std::swap(sorting_, other.sorting_);
  std::swap(sorted_room_, other.sorted_room_);
  std::swap(sorting_bytes_, other.sorting_bytes_);
  std::swap(host_report_, other.host_report_);
  std::swap(capacity_, other.capacity_);
  std::swap(error_, other.error_);
  return *this;
}

Status GpuContactQuery::fail(cudaError_t error) {
  error_ = error;
  if (error != cudaSuccess) static_cast<void>(cudaGetLastError());  // later calls must not report it again
  return status_of(error);
}

template <typename Element>
Status GpuContactQuery::allocate(Element*& out, std::size_t count) {
  void* memory = nullptr;
  const Status status = fail(cudaMalloc(&memory, std::max<std::size_t>(count, 1) * sizeof(Element)));
  if (status == Status::kOk) out = static_cast<Element*>(memory);
  return status;
}

void GpuContactQuery::free() {
  free_room();
  free_walk_blocks();
  state_is_clear_ = false;
  for (void** memory : {&assets_, &state_, &chunks_}) {
    static_cast<void>(cudaFree(std::exchange(*memory, nullptr)));
  }
  static_cast<void>(cudaFreeHost(std::exchange(host_report_, nullptr)));
  asset_count_ = asset_room_ = 0;
}

void GpuContactQuery::free_walk_blocks() {
  static_cast<void>(cudaFree(std::exchange(walk_blocks_, nullptr)));
  static_cast<void>(cudaFree(std::exchange(file_blocks_, nullptr)));
  block_room_ = 0;
}

void GpuContactQuery::free_room() {
  static_cast<void>(cudaFree(std::exchange(pairs_, nullptr)));
  static_cast<void>(cudaFree(std::exchange(world_pairs_, nullptr)));
  static_cast<void>(cudaFree(std::exchange(met_, nullptr)));
  static_cast<void>(cudaFree(std::exchange(contacts_, nullptr)));
  static_cast<void>(cudaFree(std::exchange(undecided_, nullptr)));
  free_sorting();
  capacity_ = {};
}

void GpuContactQuery::free_sorting() {
  static_cast<void>(cudaFree(std::exchange(unsorted_, nullptr)));
  static_cast<void>(cudaFree(std::exchange(order_, nullptr)));
  static_cast<void>(cudaFree(std::exchange(sorting_, nullptr)));
  sorted_room_ = sorting_bytes_ = 0;
}

Status GpuContactQuery::provide_fixed_memory(cudaStream_t stream) {
  if (host_report_ != nullptr) return Status::kOk;
  Status status = Status::kOk;
  if (state_ == nullptr) {
    gpu::QueryState* state = nullptr;
    status = allocate(state, 1);
    if (status != Status::kOk) return status;
    state_ = state;
  }
  if (chunks_ == nullptr) {
    gpu::Chunk* chunks = nullptr;
    status = allocate(chunks, gpu::kChunks);
    if (status != Status::kOk) return status;
    chunks_ = chunks;
  }
  status = fail(cudaMemsetAsync(state_, 0, sizeof(gpu::QueryState), stream));
  if (status == Status::kOk)
    status = fail(cudaMemsetAsync(chunks_, 0, gpu::kChunks * sizeof(gpu::Chunk), stream));
  if (status == Status::kOk) status = fail(cudaStreamSynchronize(stream));
  if (status != Status::kOk) return status;
  state_is_clear_ = true;
  void* report = nullptr;
  status = fail(cudaMallocHost(&report, sizeof(GpuQueryReport)));
  if (status != Status::kOk) return status == Status::kOutOfGpuMemory ? Status::kOutOfMemory : status;
  host_report_ = new (report) GpuQueryReport{};
  return Status::kOk;
}

Status GpuContactQuery::set_assets(std::span<const GpuAsset> assets, cudaStream_t stream) {
  Status status = provide_fixed_memory(stream);
  if (status != Status::kOk) return status;
  std::uint32_t depth = 1, triangles = 0;
  std::uint64_t faces = 0;
  std::uint64_t numbers = 0;
  for (const GpuAsset& asset : assets) {
    numbers += gpu::numbers_of(asset.tree);
    depth = std::max(depth, asset.tree.depth);
    triangles = std::max(triangles, asset.tree.triangle_count);
    faces = std::max(faces, asset.source_faces);
  }
  if (assets.size() >= kNoIndex || numbers > kMostNumbers) return Status::kOutOfRange;
  const auto count = static_cast<std::uint32_t>(assets.size());
  if (count > asset_room_) {
    static_cast<void>(cudaFree(std::exchange(assets_, nullptr)));
    asset_room_ = asset_count_ = 0;
    gpu::Asset* table = nullptr;
    status = allocate(table, count);
    if (status != Status::kOk) return status;
    assets_ = table;
    asset_room_ = count;
  }
  if (numbers > block_room_) {
    free_walk_blocks();
    asset_count_ = 0;
    gpu::WalkBlock* blocks = nullptr;
    status = allocate(blocks, numbers);
    walk_blocks_ = blocks;
    if (status == Status::kOk) status = allocate(file_blocks_, numbers);
    if (status != Status::kOk) return status;
    block_room_ = numbers;
  }
  asset_count_ = count;
  depth_ = depth;
  most_triangles_ = triangles;
  most_faces_ = faces;
  if (count != 0) status = make_walk_blocks(assets, stream);
  if (status != Status::kOk) asset_count_ = 0;
  return status;
}

Status GpuContactQuery::make_walk_blocks(std::span<const GpuAsset> assets, cudaStream_t stream) {
  const std::unique_ptr<gpu::Asset[]> table(new (std::nothrow) gpu::Asset[assets.size()]);
  if (table == nullptr) return Status::kOutOfMemory;
  std::uint32_t root = 0, blocks = 0;
  for (std::size_t i = 0; i < assets.size(); ++i) {
    table[i] = {assets[i], {}, root, blocks};
    root += static_cast<std::uint32_t>(gpu::numbers_of(assets[i].tree));
    blocks += assets[i].tree.block_count;
  }
  auto* const on_gpu = static_cast<gpu::Asset*>(assets_);
  std::uint32_t* number_of = nullptr;
  Status status = allocate(number_of, blocks);
  if (status != Status::kOk) return status;
  status = fail(cudaMemcpyAsync(on_gpu, table.get(), assets.size() * sizeof(gpu::Asset),
                                cudaMemcpyHostToDevice, stream));
  if (status == Status::kOk)
    status =
        fail(gpu::make_walk_blocks(on_gpu, asset_count_, blocks, static_cast<gpu::WalkBlock*>(walk_blocks_),
                                   file_blocks_, number_of, stream));
  if (status == Status::kOk) status = fail(cudaStreamSynchronize(stream));
  static_cast<void>(cudaFree(number_of));
  return status;
}

Status GpuContactQuery::reserve(const GpuQueryCapacity& wanted, const GpuQueryOptions& options) {
  if (wanted.undecided > kMostUndecided) return Status::kOutOfGpuMemory;
  if (pairs_ == nullptr || wanted.pairs > capacity_.pairs) {
    const std::uint32_t count = grown(wanted.pairs, capacity_.pairs);
    capacity_.pairs = 0;
    static_cast<void>(cudaFree(std::exchange(pairs_, nullptr)));
    static_cast<void>(cudaFree(std::exchange(world_pairs_, nullptr)));
    static_cast<void>(cudaFree(std::exchange(met_, nullptr)));
    gpu::PairRecord* records = nullptr;
    Status status = allocate(records, count);
    pairs_ = records;
    if (status == Status::kOk) status = allocate(world_pairs_, count);
    if (status == Status::kOk) status = allocate(met_, count);
    if (status != Status::kOk) return status;
    capacity_.pairs = count;
  }
  if (contacts_ == nullptr || wanted.contacts > capacity_.contacts) {
    const std::uint64_t count = grown(wanted.contacts, capacity_.contacts);
    capacity_.contacts = 0;
    static_cast<void>(cudaFree(std::exchange(contacts_, nullptr)));
    const Status status = allocate(contacts_, count + gpu::kContactsForKeys);
    if (status != Status::kOk) return status;
    capacity_.contacts = count;
  }
  if (undecided_ == nullptr || wanted.undecided > capacity_.undecided) {
    const std::uint64_t count = std::min(grown(wanted.undecided, capacity_.undecided), kMostUndecided);
    capacity_.undecided = 0;
    static_cast<void>(cudaFree(std::exchange(undecided_, nullptr)));
    gpu::Candidate* candidates = nullptr;
    const Status status = allocate(candidates, 2 * count);
    undecided_ = candidates;
    if (status != Status::kOk) return status;
    capacity_.undecided = count;
  }
  return options.sorted ? reserve_sorting() : Status::kOk;
}

Status GpuContactQuery::reserve_sorting() {
  if (capacity_.contacts <= sorted_room_ && sorting_ != nullptr) return Status::kOk;
  if (capacity_.contacts >= kNoIndex) return Status::kOutOfRange;
  free_sorting();
  std::size_t bytes = 0;
  unsigned char* sorting = nullptr;
  Status status = fail(gpu::sorting_bytes(capacity_.contacts, bytes));
  if (status == Status::kOk) status = allocate(unsorted_, capacity_.contacts);
  if (status == Status::kOk) status = allocate(order_, 2 * capacity_.contacts);
  if (status == Status::kOk) status = allocate(sorting, bytes);
  sorting_ = sorting;
  if (status != Status::kOk) {
    free_sorting();
    return status;
  }
  sorted_room_ = capacity_.contacts;
  sorting_bytes_ = bytes;
  return Status::kOk;
}

Status GpuContactQuery::enqueue(const GpuInstances& instances, const GpuPairs& pairs,
                                const GpuQueryOptions& options, cudaStream_t stream) {
  if (options.sorted && (sorting_ == nullptr || sorted_room_ < capacity_.contacts))
    return Status::kOutOfRange;
  gpu::QueryArgs args = {};
  args.assets = static_cast<const gpu::Asset*>(assets_);
  args.asset_count = asset_count_;
  args.instances = instances;
  args.given = pairs;
  args.mode = options.mode;
  args.first_contact_only = options.first_contact_only;
  args.walk_only = options.walk_only && options.mode == QueryMode::exact;
  args.capacity = capacity_;
  args.state = static_cast<gpu::QueryState*>(state_);
  args.host_report = host_report_;
  args.chunks = static_cast<gpu::Chunk*>(chunks_);
  args.pairs = static_cast<gpu::PairRecord*>(pairs_);
  args.walk_blocks = static_cast<const gpu::WalkBlock*>(walk_blocks_);
  args.file_blocks = file_blocks_;
  args.world_pairs = world_pairs_;
  args.met = met_;
  args.contacts = options.sorted ? unsorted_ : contacts_;
  args.undecided = static_cast<gpu::Candidate*>(undecided_);
  args.unresolved = args.undecided + capacity_.undecided;
  args.most_blocks = std::min(options.most_blocks, gpu::kChunks);  // a grid never has as many
  args.stack_reserve = 2 * depth_ + 32;                            // see walk.cuh
  args.stack_size = args.stack_reserve + kStackSize;
  cudaError_t error = cudaSuccess;
  if (!state_is_clear_) error = cudaMemsetAsync(args.state, 0, sizeof(gpu::QueryState), stream);
  cudaStreamCaptureStatus capture = cudaStreamCaptureStatusNone;
  if (error == cudaSuccess) error = cudaStreamIsCapturing(stream, &capture);
  if (error == cudaSuccess) error = gpu::prepare_pairs(args, stream);
  if (error == cudaSuccess)
    error = (options.mode == QueryMode::exact ? gpu::walk_exact : gpu::walk_unfused)(args, stream);
  if (error == cudaSuccess) error = gpu::walk_world(args, stream);
  if (error == cudaSuccess) error = gpu::decide_rest(args, stream);
  // What is captured has not run: the state is as before.
  if (capture == cudaStreamCaptureStatusNone) state_is_clear_ = error == cudaSuccess;
  if (error == cudaSuccess && options.sorted) {
    const gpu::SortingRoom room = {contacts_, order_, sorting_, sorting_bytes_, most_triangles_, most_faces_};
    error = gpu::sort_contacts(args, room, stream);
  }
  return fail(error);
}

Status GpuContactQuery::find_contacts(const GpuInstances& instances, const GpuPairs& pairs,
                                      const GpuQueryOptions& options, cudaStream_t stream) {
  for (;;) {
    Status status = reserve(capacity_, options);  // where nothing was reserved yet
    if (status == Status::kOk) status = enqueue(instances, pairs, options, stream);
    if (status == Status::kOk) status = fail(cudaStreamSynchronize(stream));
    if (status != Status::kOk) return status;
    if (report().status != Status::kOk) return report().status;
    if (report().complete != 0) return Status::kOk;
    GpuQueryCapacity needed = report().needed;
    // What is looked at before a pair's first contact is found differs from run to run.
    if (options.first_contact_only) needed.undecided += needed.undecided / 2 + 1024;
    if (needed.pairs > pairs.capacity) return Status::kOutOfRange;
    status = reserve(needed, options);
    if (status != Status::kOk) return status;
  }
}

const GpuQueryReport* GpuContactQuery::device_report() const {
  return &static_cast<const gpu::QueryState*>(state_)->report;
}

std::size_t GpuContactQuery::bytes() const {
  std::size_t bytes =
      asset_room_ * sizeof(gpu::Asset) + block_room_ * (sizeof(gpu::WalkBlock) + sizeof(std::uint32_t));
  if (state_ != nullptr) bytes += sizeof(gpu::QueryState);
  if (chunks_ != nullptr) bytes += gpu::kChunks * sizeof(gpu::Chunk);
  bytes += capacity_.pairs * (sizeof(gpu::PairRecord) + 2 * sizeof(std::uint32_t));
  bytes += capacity_.contacts * sizeof(Contact) + capacity_.undecided * 2 * sizeof(gpu::Candidate);
  if (contacts_ != nullptr) bytes += gpu::kContactsForKeys * sizeof(Contact);
  bytes += sorted_room_ * (sizeof(Contact) + 2 * sizeof(std::uint32_t)) + sorting_bytes_;
  return bytes;
}

}  // namespace tandem
