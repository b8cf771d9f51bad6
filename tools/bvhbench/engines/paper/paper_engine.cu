#include "paper_engine.h"

#include <algorithm>
#include <new>

#include "paper_engine_data.h"
#include "tandem/formats/gpu_memory.h"
#include "tandem/formats/gpu_status.h"
#include "tandem/formats/gpu_stream.h"

namespace tandem::bench {

using paper::Entry;
using paper::kCollision;
using paper::kLeaf;

namespace {

/// The answers that the CPU reads, in memory that the GPU copies to.
struct Answers {
  paper::Outcome outcome;
  std::uint32_t pair_count;
  std::uint32_t totals[2];  ///< by FlagArray
};

enum Moment { kBegin, kPrepared, kTraversed, kEnd, kMoments };

}  // namespace

struct PaperEngine::State {
  GpuArray<GpuAsset> assets;
  GpuArray<paper::PairRecord> records;
  GpuArray<Entry> levels[2];
  GpuArray<std::uint32_t> flags[2];
  GpuArray<std::uint32_t> sums;  ///< two rows
  GpuArray<std::uint8_t> scratch;
  GpuArray<Entry> candidates;
  GpuArray<Entry> undecided;  ///< two rows
  GpuArray<Contact> contacts;
  GpuArray<paper::Outcome> outcome;
  PinnedArray<Answers> answers;
  GpuEvent moments[kMoments];
  std::uint32_t asset_count = 0;
  std::uint64_t candidate_count = 0;
  PaperReport report;
  cudaError_t error = cudaSuccess;

  /// Returns whether all went well so far; keeps the first error.
  bool ok(cudaError_t result) {
    if (error == cudaSuccess && result != cudaSuccess) {
      error = result;
      static_cast<void>(cudaGetLastError());  // one that failed is not to be reported again by later calls
    }
    return error == cudaSuccess;
  }

  Status status() const { return status_of(error); }

  bool provide() {
    if (answers.data() != nullptr) return true;
    for (GpuEvent& moment : moments) {
      if (!ok(moment.create())) return false;
    }
    if (!ok(outcome.reserve(1)) || !ok(answers.reserve(1))) return false;
    *answers = {};
    return true;
  }

  bool set_assets(std::span<const GpuAsset> given, cudaStream_t stream);
  Status prepare(paper::QueryArgs& args, cudaStream_t stream);
  Status traverse(PaperFlags kind, cudaStream_t stream);
  bool test_level(paper::Level& level, PaperFlags kind, cudaStream_t stream);
  bool read_total(const std::uint32_t* total, paper::FlagArray array, cudaStream_t stream) {
    return ok(cudaMemcpyAsync(&answers->totals[array], total, sizeof *total, cudaMemcpyDeviceToHost, stream));
  }
  bool test_triangles(const paper::QueryArgs& args, QueryMode mode, cudaStream_t stream);
  void count_contacts(QueryMode mode);
  bool measure_times(cudaStream_t stream);
  Status run(paper::QueryArgs& args, const PaperOptions& options, cudaStream_t stream);
};

bool PaperEngine::State::set_assets(std::span<const GpuAsset> given, cudaStream_t stream) {
  asset_count = 0;
  if (!provide() || !ok(assets.grow(given.size())) || !ok(assets.upload(given, stream)) ||
      !ok(cudaStreamSynchronize(stream)))
    return false;
  asset_count = static_cast<std::uint32_t>(given.size());
  return true;
}

/// Records and first level, in the room that there was last time; once more where that was too little.
Status PaperEngine::State::prepare(paper::QueryArgs& args, cudaStream_t stream) {
  for (;;) {
    args.records = records.data();
    args.record_room = static_cast<std::uint32_t>(std::min(records.room(), levels[0].room()));
    const bool ran = ok(cudaMemsetAsync(outcome.data(), 0, sizeof(paper::Outcome), stream)) &&
                     ok(paper::prepare(args, levels[0].data(), stream)) &&
                     ok(cudaMemcpyAsync(&answers->outcome, outcome.data(), sizeof(paper::Outcome),
                                        cudaMemcpyDeviceToHost, stream)) &&
                     ok(cudaMemcpyAsync(&answers->pair_count, args.given.count, sizeof(std::uint32_t),
                                        cudaMemcpyDeviceToHost, stream)) &&
                     ok(cudaStreamSynchronize(stream));
    if (!ran) return status();
    if (answers->pair_count > args.given.capacity) return Status::kOutOfRange;
    if (answers->pair_count <= args.record_room) break;
    if (!ok(records.grow(answers->pair_count)) || !ok(levels[0].grow(answers->pair_count))) return status();
  }
  report.counters.object_pairs = answers->pair_count;
  if (answers->outcome.error == 0) return Status::kOk;
  report.where = gpu::where_in(answers->outcome.error);
  return gpu::status_in(answers->outcome.error);
}

/// Makes one iteration of the paper's loop but for the collection: flags, their prefix sums, and the totals.
bool PaperEngine::State::test_level(paper::Level& level, PaperFlags kind, cudaStream_t stream) {
  const std::size_t count = paper::sum_count(kind, level.count);
  for (const auto array : {kCollision, kLeaf}) {
    if (!ok(flags[array].grow(count))) return false;
    level.flags[array] = flags[array].data();
  }
  if (!ok(sums.grow(2 * count))) return false;
  level.sums[kCollision] = sums.data();
  level.sums[kLeaf] = sums.data() + count;
  std::size_t scratch_bytes = 0;
  if (!ok(paper::scan(level, kind, nullptr, scratch_bytes, stream)) ||
      !ok(scratch.grow(std::max<std::size_t>(scratch_bytes, 1))))
    return false;
  scratch_bytes = scratch.room();
  return ok(paper::collide(level, kind, stream)) &&
         ok(paper::scan(level, kind, scratch.data(), scratch_bytes, stream)) &&
         read_total(level.sums[kCollision] + (count - 1), kCollision, stream) &&
         read_total(level.sums[kLeaf] + (count - 1), kLeaf, stream) && ok(cudaStreamSynchronize(stream));
}

Status PaperEngine::State::traverse(PaperFlags kind, cudaStream_t stream) {
  std::uint64_t count = answers->pair_count;
  candidate_count = 0;
  for (int current = 0; count != 0; current = 1 - current) {
    if (count > paper::kMostBlockPairs) return Status::kOutOfGpuMemory;
    paper::Level level = {levels[current].data(), static_cast<std::uint32_t>(count), records.data(), {}, {}};
    if (!test_level(level, kind, stream)) return status();
    report.levels += 1;
    report.counters.block_pairs += count;
    report.largest_level = std::max(report.largest_level, count);

    GpuArray<Entry>& next = levels[1 - current];
    const std::uint32_t below = answers->totals[kCollision], leaves = answers->totals[kLeaf];
    if (!ok(next.grow(below)) || !ok(candidates.grow(candidate_count + leaves, candidate_count)))
      return status();
    if ((below | leaves) != 0 &&
        !ok(paper::collect(level, kind, next.data(), candidates.data() + candidate_count, stream)))
      return status();
    candidate_count += leaves;
    count = below;
  }
  report.counters.candidates = candidate_count;
  return Status::kOk;
}

/// Tests in the room that there was last time, and once more where that was too little.
bool PaperEngine::State::test_triangles(const paper::QueryArgs& args, QueryMode mode, cudaStream_t stream) {
  answers->outcome = {};
  if (candidate_count == 0) return true;
  if (mode == QueryMode::boxes && !ok(contacts.grow(candidate_count))) return false;
  for (;;) {
    const std::size_t undecided_room = undecided.room() / 2;
    const paper::TriangleArgs triangles = {candidates.data(), candidate_count,
                                           contacts.data(),   contacts.room(),
                                           undecided.data(),  undecided.data() + undecided_room,
                                           undecided_room};
    const bool ran = ok(cudaMemsetAsync(outcome.data(), 0, sizeof(paper::Outcome), stream)) &&
                     ok(paper::decide_by_float32(args, triangles, mode, stream)) &&
                     (mode == QueryMode::boxes || ok(paper::decide_rest(args, triangles, mode, stream))) &&
                     ok(cudaMemcpyAsync(&answers->outcome, outcome.data(), sizeof(paper::Outcome),
                                        cudaMemcpyDeviceToHost, stream)) &&
                     ok(cudaStreamSynchronize(stream));
    if (!ran) return false;
    const paper::Outcome& found = answers->outcome;
    if (found.contacts <= contacts.room() && found.undecided <= undecided_room) return true;
    if (!ok(contacts.grow(found.contacts)) || !ok(undecided.grow(2 * found.undecided))) return false;
  }
}

void PaperEngine::State::count_contacts(QueryMode mode) {
  const paper::Outcome& found = answers->outcome;
  ContactCounters& counters = report.counters;
  counters.contacts = found.contacts;
  counters.decided_by_float64 = found.decided_by_float64;
  counters.decided_exactly = found.unresolved;
  if (mode != QueryMode::boxes)
    counters.decided_by_float32 = candidate_count - found.decided_by_float64 - found.unresolved;
}

bool PaperEngine::State::measure_times(cudaStream_t stream) {
  return ok(moments[kEnd].record(stream)) && ok(cudaEventSynchronize(moments[kEnd].get())) &&
         ok(milliseconds_between(moments[kBegin], moments[kPrepared], report.preparation_ms)) &&
         ok(milliseconds_between(moments[kPrepared], moments[kTraversed], report.traversal_ms)) &&
         ok(milliseconds_between(moments[kTraversed], moments[kEnd], report.triangle_ms));
}

Status PaperEngine::State::run(paper::QueryArgs& args, const PaperOptions& options, cudaStream_t stream) {
  if (!ok(moments[kBegin].record(stream))) return status();
  Status result = prepare(args, stream);
  if (result != Status::kOk || !ok(moments[kPrepared].record(stream)))
    return result != Status::kOk ? result : status();
  result = traverse(options.flags, stream);
  if (result != Status::kOk || !ok(moments[kTraversed].record(stream)))
    return result != Status::kOk ? result : status();
  if (!test_triangles(args, options.mode, stream)) return status();
  count_contacts(options.mode);
  return measure_times(stream) ? Status::kOk : status();
}

PaperEngine::PaperEngine() : state_(new (std::nothrow) State) {}
PaperEngine::PaperEngine(PaperEngine&&) noexcept = default;
PaperEngine& PaperEngine::operator=(PaperEngine&&) noexcept = default;
PaperEngine::~PaperEngine() = default;

Status PaperEngine::set_assets(std::span<const GpuAsset> assets, cudaStream_t stream) {
  if (state_ == nullptr) return Status::kOutOfMemory;
  for (const GpuAsset& asset : assets) {
    if (asset.tree.blocks == nullptr) return Status::kNoAxisAlignedBlocks;
  }
  state_->error = cudaSuccess;
  state_->set_assets(assets, stream);
  return state_->status();
}

Status PaperEngine::find_contacts(const GpuInstances& instances, const GpuPairs& pairs,
                                  const PaperOptions& options, cudaStream_t stream) {
  State& s = *state_;
  s.error = cudaSuccess;
  s.report = {};
  paper::QueryArgs args = {s.assets.data(), s.asset_count, instances, pairs, nullptr, 0, s.outcome.data()};
  const Status result = s.run(args, options, stream);
  if (result != Status::kOk) {
    const std::uint64_t where = s.report.where;
    s.report = {};
    s.report.where = where;
  }
  return result;
}

const Contact* PaperEngine::contacts() const {
  return state_->contacts.data();
}

const PaperReport& PaperEngine::report() const {
  return state_->report;
}

std::size_t PaperEngine::bytes() const {
  const State& s = *state_;
  return s.assets.bytes() + s.records.bytes() + s.levels[0].bytes() + s.levels[1].bytes() +
         s.flags[0].bytes() + s.flags[1].bytes() + s.sums.bytes() + s.scratch.bytes() + s.candidates.bytes() +
         s.undecided.bytes() + s.contacts.bytes() + s.outcome.bytes();
}

cudaError_t PaperEngine::cuda_error() const {
  return state_->error;
}

}  // namespace tandem::bench
