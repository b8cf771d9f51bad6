#include "gpu_impacts.h"

#include <algorithm>
#include <tuple>

#include "gpu_engine.h"
#include "tandem/formats/gpu_status.h"
#include "tandem/kernels/gpu_impact_query.h"

namespace tandem {
namespace {

template <typename Element>
std::span<const Element> of_each(const Element* elements, std::size_t count) {
  return {elements, elements != nullptr ? count : 0};
}

// By a, then b. On the CPU, as contacts are sorted there: it is no part of a step.
void sort(TimedImpacts& found) {
  std::vector<std::pair<ObjectPair, Impact>> rows;
  for (std::size_t i = 0; i < found.pairs.size(); ++i) rows.emplace_back(found.pairs[i], found.impacts[i]);
  std::sort(rows.begin(), rows.end(), [](const auto& x, const auto& y) {
    return std::pair(x.first.a, x.first.b) < std::pair(y.first.a, y.first.b);
  });
  for (std::size_t i = 0; i < rows.size(); ++i) std::tie(found.pairs[i], found.impacts[i]) = rows[i];
}

// Bodies on the GPU, and their impacts.
class GpuImpactRun {
 public:
  explicit GpuImpactRun(const MovingBodies& moving)
      : moving_(moving), options_{.tolerance = moving.tolerance} {
    std::size_t total = 0;
    check(cudaFree(nullptr), "start");
    check(cudaMemGetInfo(&free_at_start_, &total), "memory");
    check(stream_.create(), "a stream");
    Stopwatch watch;
    upload_shapes();
    upload_bodies();
    upload_filter();
    check(stream_.wait(), "upload");
    upload_seconds_ = watch.lap();
  }

  TimedImpacts time(std::uint32_t repeats) {
    Status status =
        pairs_.count == nullptr
            ? query_.find(instances_, motion_.data(), moving_.duration, options_, stream_.get())
            : query_.find(instances_, motion_.data(), moving_.duration, pairs_, options_, stream_.get());
    if (subject(status) != nullptr)
      throw EngineError(std::string("tandem-cuda: ") + explain(status), status, query_.report().where);
    check(status, query_.cuda_error(), "impacts");
    TimedImpacts out;
    out.seconds = time_repeats(repeats);
    take(out);
    return out;
  }

 private:
  void check(Status status, cudaError_t error, const char* step) const {
    check_on_gpu("tandem-cuda", status, error, step);
  }
  void check(cudaError_t error, const char* step) const { check(status_of(error), error, step); }

  template <typename Element>
  void upload(GpuArray<Element>& array, std::span<const Element> elements, const char* step) {
    check(array.upload(elements, stream_.get()), step);
  }

  void upload_shapes() {
    check(uploaded_.upload(moving_.shapes, Contents::all, stream_.get()), uploaded_.cuda_error(), "assets");
    for (std::size_t i = 0; i < moving_.shapes.size(); ++i)
      shapes_.push_back(gpu_asset(uploaded_.level(i), moving_.shapes[i]));
    check(query_.set_assets(shapes_, stream_.get()), query_.cuda_error(), "assets");
  }

  void upload_bodies() {
    for (const Instance& body : moving_.bodies) {
      shape_of_body_.push_back(body.asset);
      pose_of_body_.push_back(body.pose);
    }
    upload<std::uint32_t>(shape_of_, shape_of_body_, "instances");
    upload<Pose>(poses_, pose_of_body_, "instances");
    upload(motion_, moving_.motion, "instances");
    instances_ = {shape_of_.data(), poses_.data(), static_cast<std::uint32_t>(moving_.bodies.size())};
    if (moving_.given == nullptr) return;
    given_count_ = static_cast<std::uint32_t>(moving_.given->size());
    upload<ObjectPair>(given_, *moving_.given, "instances");
    upload<std::uint32_t>(count_, {&given_count_, 1}, "instances");
    pairs_ = {given_.data(), count_.data(), given_count_};
  }

  void upload_filter() {
    const PairFilter& filter = moving_.filter;
    const std::size_t count = moving_.bodies.size();
    check(excluded_.upload(filter.excluded, stream_.get()), excluded_.cuda_error(), "filter");
    upload(filter_motion_, of_each(filter.motion, count), "filter");
    upload(group_, of_each(filter.group, count), "filter");
    upload(mask_, of_each(filter.mask, count), "filter");
    options_.filter = {filter_motion_.data(), group_.data(), mask_.data(), excluded_.view()};
  }

  void enqueue() {
    const Status status =
        pairs_.count == nullptr
            ? query_.enqueue(instances_, motion_.data(), moving_.duration, options_, stream_.get())
            : query_.enqueue(instances_, motion_.data(), moving_.duration, pairs_, options_, stream_.get());
    check(status, query_.cuda_error(), "impacts");
  }

  Seconds time_repeats(std::uint32_t repeats) {
    GpuEvent begin, end;
    for (GpuEvent* event : {&begin, &end}) check(event->create(), "an event");
    GpuGraph graph;
    check(graph.capture(stream_.get(), [&] { enqueue(); }), "a graph");
    Seconds seconds;
    for (std::uint32_t i = 0; i < repeats; ++i) {
      check(begin.record(stream_.get()), "an event");
      check(graph.launch(stream_.get()), "a graph");
      check(end.record(stream_.get()), "an event");
      check(stream_.wait(), "impacts");
      float milliseconds = 0;
      check(milliseconds_between(begin, end, milliseconds), "time");
      seconds.push_back(1e-3 * static_cast<double>(milliseconds));
    }
    return seconds;
  }

  void take(TimedImpacts& out) const {
    const GpuImpactReport& report = query_.report();
    if (report.status != Status::kOk || report.complete == 0)
      throw std::runtime_error("the GPU: a repeat of the query found something else than the first");
    out.counters = report.counters;
    out.rounds = report.rounds;
    out.pairs.resize(report.impacts);
    out.impacts.resize(report.impacts);
    const ObjectPair* pairs = pairs_.count == nullptr ? query_.pairs().pairs : pairs_.pairs;
    check(download(pairs, std::span(out.pairs), stream_.get()), "download");
    check(download(query_.impacts(), std::span(out.impacts), stream_.get()), "download");
    if (pairs_.count == nullptr) sort(out);
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
    const std::size_t scene = uploaded_.bytes() + shape_of_.bytes() + poses_.bytes() + motion_.bytes() +
                              given_.bytes() + filter_motion_.bytes() + group_.bytes() + mask_.bytes() +
                              excluded_.bytes();
    use.name = properties.name;
    use.upload = upload_seconds_;
    use.bytes = scene + query_.bytes();
    use.bytes_bound = scene + most_impact_bytes(query_.capacity(), shapes_.size(), false);
    use.bytes_taken = free_at_start_ - free;
    return use;
  }

  const MovingBodies& moving_;
  GpuImpactOptions options_;
  std::size_t free_at_start_ = 0;
  double upload_seconds_ = 0;
  GpuStream stream_;
  DeviceAssets uploaded_;
  std::vector<GpuAsset> shapes_;
  std::vector<std::uint32_t> shape_of_body_;
  std::vector<Pose> pose_of_body_;
  std::uint32_t given_count_ = 0;
  GpuArray<std::uint32_t> shape_of_, count_, group_, mask_;
  GpuArray<Pose> poses_;
  GpuArray<RigidMotion> motion_;
  GpuArray<ObjectPair> given_;
  GpuArray<Motion> filter_motion_;
  GpuExcludedPairs excluded_;
  GpuInstances instances_ = {};
  GpuPairs pairs_ = {};
  GpuImpactQuery query_;
};

}  // namespace

TimedImpacts time_impacts_on_gpu(const MovingBodies& moving, std::uint32_t repeats) {
  return GpuImpactRun(moving).time(repeats);
}

}  // namespace tandem
