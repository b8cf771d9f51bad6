#include "gpu_distances.h"

#include "gpu_engine.h"
#include "tandem/formats/gpu_status.h"
#include "tandem/kernels/gpu_distance_query.h"

namespace tandem {
namespace {

template <typename Element>
std::span<const Element> of_each(const Element* elements, std::size_t count) {
  return {elements, elements != nullptr ? count : 0};
}

// Bodies on the GPU, and their distances.
class GpuDistanceRun {
 public:
  explicit GpuDistanceRun(const BodiesApart& bodies)
      : bodies_(bodies), options_{.tolerance = bodies.tolerance, .reach = bodies.reach} {
    std::size_t total = 0;
    check(cudaFree(nullptr), "start");
    check(cudaMemGetInfo(&free_at_start_, &total), "memory");
    check(stream_.create(), "a stream");
    Stopwatch watch;
    upload_shapes();
    upload_bodies();
    check(stream_.wait(), "upload");
    upload_seconds_ = watch.lap();
  }

  TimedDistances time(std::uint32_t repeats) {
    if (bodies_.given != nullptr) {
      upload_pairs();
    } else {
      upload_filter();
      const Status status = broad_phase_.find_pairs(instances_, bounds_, near_pairs_, stream_.get());
      require(status, broad_phase_.cuda_error(), broad_phase_.report().where, "broad phase");
      pairs_ = broad_phase_.pairs();
      pair_count_ = broad_phase_.report().count;
    }
    const Status status = query_.find_distances(instances_, pairs_, options_, stream_.get());
    require(status, query_.cuda_error(), query_.report().where, "distances");
    TimedDistances out;
    out.nearest = time_repeats(repeats, [&] { enqueue(); });
    out.seconds = bodies_.given != nullptr ? out.nearest : time_repeats(repeats, [&] {
      check(broad_phase_.enqueue(instances_, bounds_, near_pairs_, stream_.get()), broad_phase_.cuda_error(),
            "broad phase");
      enqueue();
    });
    take(out);
    return out;
  }

 private:
  void check(Status status, cudaError_t error, const char* step) const {
    check_on_gpu("tandem-cuda", status, error, step);
  }
  void check(cudaError_t error, const char* step) const { check(status_of(error), error, step); }
  void require(Status status, cudaError_t error, std::uint64_t where, const char* step) const {
    if (subject(status) != nullptr)
      throw EngineError(std::string("tandem-cuda: ") + explain(status), status, where);
    check(status, error, step);
  }

  template <typename Element>
  void upload(GpuArray<Element>& array, std::span<const Element> elements, const char* step) {
    check(array.upload(elements, stream_.get()), step);
  }

  void upload_shapes() {
    check(uploaded_.upload(bodies_.shapes, Contents::all, stream_.get()), uploaded_.cuda_error(), "assets");
    for (std::size_t i = 0; i < bodies_.shapes.size(); ++i) {
      shapes_.push_back(gpu_asset(uploaded_.level(i), bodies_.shapes[i]));
      bounds_of_shape_.push_back(asset_bounds(*bodies_.shapes[i].header));
    }
    upload<AssetBounds>(bounds_of_, bounds_of_shape_, "assets");
    bounds_ = {bounds_of_.data(), static_cast<std::uint32_t>(shapes_.size())};
    check(query_.set_assets(shapes_, stream_.get()), query_.cuda_error(), "assets");
  }

  void upload_bodies() {
    for (const Instance& body : bodies_.bodies) {
      shape_of_body_.push_back(body.asset);
      pose_of_body_.push_back(body.pose);
    }
    upload<std::uint32_t>(shape_of_, shape_of_body_, "instances");
    upload<Pose>(poses_, pose_of_body_, "instances");
    instances_ = {shape_of_.data(), poses_.data(), static_cast<std::uint32_t>(bodies_.bodies.size())};
  }

  void upload_pairs() {
    pair_count_ = static_cast<std::uint32_t>(bodies_.given->size());
    upload<ObjectPair>(given_, *bodies_.given, "instances");
    upload<std::uint32_t>(count_, {&pair_count_, 1}, "instances");
    pairs_ = {given_.data(), count_.data(), pair_count_};
  }

  void upload_filter() {
    const PairFilter& filter = bodies_.filter;
    const std::size_t count = bodies_.bodies.size();
    check(excluded_.upload(filter.excluded, stream_.get()), excluded_.cuda_error(), "filter");
    upload(motion_, of_each(filter.motion, count), "filter");
    upload(group_, of_each(filter.group, count), "filter");
    upload(mask_, of_each(filter.mask, count), "filter");
    near_pairs_ = {.sorted = true,
                   .filter = {motion_.data(), group_.data(), mask_.data(), excluded_.view()},
                   .within = bodies_.reach};
  }

  void enqueue() {
    check(query_.enqueue(instances_, pairs_, options_, stream_.get()), query_.cuda_error(), "distances");
  }

  template <typename Work>
  Seconds time_repeats(std::uint32_t repeats, const Work& work) {
    GpuEvent begin, end;
    for (GpuEvent* event : {&begin, &end}) check(event->create(), "an event");
    GpuGraph graph;
    check(graph.capture(stream_.get(), work), "a graph");
    Seconds seconds;
    for (std::uint32_t i = 0; i < repeats; ++i) {
      check(begin.record(stream_.get()), "an event");
      check(graph.launch(stream_.get()), "a graph");
      check(end.record(stream_.get()), "an event");
      check(stream_.wait(), "distances");
      float milliseconds = 0;
      check(milliseconds_between(begin, end, milliseconds), "time");
      seconds.push_back(1e-3 * static_cast<double>(milliseconds));
    }
    return seconds;
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
    out.gpu = use();
  }

  GpuUse use() const {
    GpuUse use;
    int device = 0;
    cudaDeviceProp properties;
    std::size_t free = 0, total = 0;
    check(cudaMemGetInfo(&free, &total), "memory");
    check(cudaGetDevice(&device), "start");
    check(cudaGetDeviceProperties(&properties, device), "start");
    const std::size_t scene = uploaded_.bytes() + bounds_of_.bytes() + shape_of_.bytes() + poses_.bytes() +
                              given_.bytes() + count_.bytes() + motion_.bytes() + group_.bytes() +
                              mask_.bytes() + excluded_.bytes() + broad_phase_.bytes();
    use.name = properties.name;
    use.upload = upload_seconds_;
    use.bytes = scene + query_.bytes();
    use.bytes_bound = scene + most_distance_bytes(query_.capacity(), shapes_.size());
    use.bytes_taken = free_at_start_ - free;
    return use;
  }

  const BodiesApart& bodies_;
  const GpuDistanceOptions options_;
  std::size_t free_at_start_ = 0;
  double upload_seconds_ = 0;
  GpuStream stream_;
  DeviceAssets uploaded_;
  std::vector<GpuAsset> shapes_;
  std::vector<AssetBounds> bounds_of_shape_;
  std::vector<std::uint32_t> shape_of_body_;
  std::vector<Pose> pose_of_body_;
  std::uint32_t pair_count_ = 0;
  GpuArray<AssetBounds> bounds_of_;
  GpuArray<std::uint32_t> shape_of_, count_, group_, mask_;
  GpuArray<Pose> poses_;
  GpuArray<ObjectPair> given_;
  GpuArray<Motion> motion_;
  GpuExcludedPairs excluded_;
  GpuAssetBounds bounds_ = {};
  GpuInstances instances_ = {};
  GpuPairs pairs_ = {};
  GpuBroadPhaseOptions near_pairs_;
  GpuBroadPhase broad_phase_;
  GpuDistanceQuery query_;
};

}  // namespace

TimedDistances time_distances_on_gpu(const BodiesApart& bodies, std::uint32_t repeats) {
  return GpuDistanceRun(bodies).time(repeats);
}

}  // namespace tandem
