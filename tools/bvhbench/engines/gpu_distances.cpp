#include "gpu_distances.h"

#include "gpu_run.h"
#include "tandem/kernels/gpu_distance_query.h"

namespace tandem {
namespace {

// Bodies on the GPU, and their distances.
class GpuDistanceRun : GpuRun {
 public:
  explicit GpuDistanceRun(const BodiesApart& bodies)
      : GpuRun(bodies.shapes, bodies.bodies, bodies.given, bodies.filter, bodies.reach),
        options_{.tolerance = bodies.tolerance, .reach = bodies.reach} {
    upload_shapes(Contents::all);
    std::vector<GpuAsset> shapes;
    for (std::size_t i = 0; i < shapes_.size(); ++i)
      shapes.push_back(gpu_asset(uploaded_.level(i), shapes_[i]));
    check(query_.set_assets(shapes, stream_.get()), query_.cuda_error(), "assets");
    end_upload();
  }

  TimedDistances time(std::uint32_t repeats) {
    find_pairs();
    const Status status = query_.find_distances(instances_, pairs_, options_, stream_.get());
    require(status, query_.cuda_error(), query_.report().where, "distances");
    TimedDistances out;
    out.nearest = time_repeats(repeats, [&] { enqueue(); });
    out.seconds = given_ != nullptr ? out.nearest : time_repeats(repeats, [&] {
      enqueue_broad_phase();
      enqueue();
    });
    take(out);
    return out;
  }

 private:
  void enqueue() {
    check(query_.enqueue(instances_, pairs_, options_, stream_.get()), query_.cuda_error(), "distances");
  }

  void take(TimedDistances& out) const {
    const GpuDistanceReport& report = query_.report();
    if (report.status != Status::kOk || report.complete == 0)
      throw std::runtime_error("the GPU: a repeat of the query found something else than the first");
    out.counters = report.counters;
    out.rounds = report.rounds;
    out.pairs.resize(pair_count_);
    out.distances.resize(pair_count_);
    check(download(pairs_.pairs, std::span(out.pairs), stream_.get()), "download");
    check(download(query_.distances(), std::span(out.distances), stream_.get()), "download");
    out.gpu = use(query_.bytes(), most_distance_bytes(query_.capacity(), shapes_.size()));
  }

  const GpuDistanceOptions options_;
  GpuDistanceQuery query_;
};

}  // namespace

TimedDistances time_distances_on_gpu(const BodiesApart& bodies, std::uint32_t repeats) {
  return GpuDistanceRun(bodies).time(repeats);
}

}  // namespace tandem
