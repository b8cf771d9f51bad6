#include "gpu_tolerance.h"

#include "gpu_run.h"
#include "tandem/kernels/gpu_tolerance_query.h"

namespace tandem {
namespace {

// Bodies on the GPU, and what is certain of them.
class GpuToleranceRun : GpuRun {
 public:
  explicit GpuToleranceRun(const BodiesWithLevels& bodies)
      : GpuRun(bodies.shapes, bodies.bodies, bodies.given, bodies.filter, 0), tolerance_(bodies.tolerance) {
    upload_shapes(Contents::exact_queries);
    for (std::size_t i = 0; i < shapes_.size(); ++i) {
      for (std::uint32_t level = 0; level < shapes_[i].levels.size(); ++level)
        levels_.push_back(gpu_asset(uploaded_.level(i, level), shapes_[i], level));
    }
    check(query_.set_assets(levels_, stream_.get()), query_.cuda_error(), "assets");
    end_upload();
  }

  TimedVerdicts time(std::uint32_t repeats) {
    find_pairs();
    const Status status = query_.decide(instances_, pairs_, tolerance_, stream_.get());
    require(status, query_.cuda_error(), query_.report().where, "verdicts");
    make_room_for_repeats();
    TimedVerdicts out;
    out.deciding = time_repeats(repeats, [&] { enqueue(); });
    out.seconds = given_ != nullptr ? out.deciding : time_repeats(repeats, [&] {
      enqueue_broad_phase();
      enqueue();
    });
    take(out);
    return out;
  }

 private:
  // What is looked at before a pair's first contact is found differs from run to run.
  void make_room_for_repeats() {
    GpuToleranceCapacity room = query_.report().needed;
    room.undecided += room.undecided / 2 + 1024;
    check(query_.reserve(room), query_.cuda_error(), "room");
  }

  void enqueue() {
    check(query_.enqueue(instances_, pairs_, tolerance_, stream_.get()), query_.cuda_error(), "verdicts");
  }

  void take(TimedVerdicts& out) const {
    const GpuToleranceReport& report = query_.report();
    if (report.status != Status::kOk || report.complete == 0)
      throw std::runtime_error("the GPU: a repeat of the query found something else than the first");
    out.counters = report.counters;
    out.pairs.resize(pair_count_);
    out.verdicts.resize(pair_count_);
    check(download(pairs_.pairs, std::span(out.pairs), stream_.get()), "download");
    check(download(query_.verdicts(), std::span(out.verdicts), stream_.get()), "download");
    out.gpu = use(query_.bytes(), most_tolerance_bytes(query_.capacity(), levels_.size()));
  }

  const double tolerance_;
  std::vector<GpuAsset> levels_;
  GpuToleranceQuery query_;
};

}  // namespace

TimedVerdicts time_verdicts_on_gpu(const BodiesWithLevels& bodies, std::uint32_t repeats) {
  return GpuToleranceRun(bodies).time(repeats);
}

}  // namespace tandem
