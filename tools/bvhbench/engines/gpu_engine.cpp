#include "gpu_engine.h"

#include <algorithm>
#include <numeric>
#include <tuple>

#include "tandem/formats/gpu_status.h"

namespace tandem {
namespace {

std::string free_memory() {
  std::size_t free = 0, total = 0;
  if (cudaMemGetInfo(&free, &total) != cudaSuccess) return {};
  return std::to_string(free >> 20) + " of " + std::to_string(total >> 20) + " MiB are free";
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

std::string reason_of(Status status, cudaError_t error) {
  if (status == Status::kOutOfGpuMemory) return free_memory();
  return error == cudaErrorInsufficientDriver ? driver_defect() : cudaGetErrorString(error);
}

void put(std::span<const Contact> contacts, std::vector<TriangleContact>& into) {
  into.resize(contacts.size());
  std::transform(contacts.begin(), contacts.end(), into.begin(), [](const Contact& c) {
    return TriangleContact{c.pair, c.triangle_a, c.triangle_b};
  });
}

// Manifolds are made of contacts that are grouped.
OrderOnGpu order_of_query(const TimedQuery& asked) {
  return asked.manifolds && asked.order == OrderOnGpu::any ? OrderOnGpu::grouped : asked.order;
}

// Of what the GPU was to group or sort.
void check_order(const std::vector<Contact>& contacts, OrderOnGpu order) {
  if (order == OrderOnGpu::any) return;
  const auto key = [](const Contact& c) {
    return std::tie(c.pair, c.face_a, c.face_b, c.triangle_a, c.triangle_b);
  };
  const auto after = [&](const Contact& x, const Contact& y) {
    return order == OrderOnGpu::sorted ? key(x) >= key(y) : x.pair > y.pair;
  };
  if (std::adjacent_find(contacts.begin(), contacts.end(), after) == contacts.end()) return;
  throw std::runtime_error("the GPU: its contacts are not in order");
}

// Manifolds by their new rows, and their points with them. Within a pair they stay as they are.
void sort_manifolds(const std::vector<std::uint32_t>& row, TimedManifolds& made) {
  for (Manifold& manifold : made.manifolds) manifold.pair = row[manifold.pair];
  std::stable_sort(made.manifolds.begin(), made.manifolds.end(),
                   [](const Manifold& x, const Manifold& y) { return x.pair < y.pair; });
  const std::vector<ManifoldPoint> points = std::move(made.points);
  made.points.clear();
  for (std::uint32_t i = 0; i < made.manifolds.size(); ++i) {
    Manifold& manifold = made.manifolds[i];
    const auto first = points.begin() + manifold.first_point;
    manifold.first_point = static_cast<std::uint32_t>(made.points.size());
    made.points.insert(made.points.end(), first, first + manifold.point_count);
    for (std::uint32_t k = manifold.first_point; k < made.points.size(); ++k) made.points[k].manifold = i;
  }
}

// Brings the pairs into ascending order, and the contacts' rows with them.
void sort_pairs(TimedAnswer& answer) {
  const std::vector<ObjectPair> pairs = std::move(answer.pairs);
  const auto key = [&](std::uint32_t i) { return std::tie(pairs[i].a, pairs[i].b); };
  std::vector<std::uint32_t> order(pairs.size()), row(pairs.size());
  std::iota(order.begin(), order.end(), 0u);
  std::sort(order.begin(), order.end(), [&](auto x, auto y) { return key(x) < key(y); });
  answer.pairs.clear();
  for (std::uint32_t i = 0; i < order.size(); ++i) {
    row[order[i]] = i;
    answer.pairs.push_back(pairs[order[i]]);
  }
  for (TriangleContact& contact : answer.contacts) contact.pair = row[contact.pair];
  sort_manifolds(row, answer.manifolds);
}

}  // namespace

// The context is made first, so that nothing that is timed is charged with it.
GpuEngine::GpuEngine(std::string_view name, Contents contents, double within)
    : name_(name), contents_(contents), within_(within) {
  std::size_t total = 0;
  check(cudaFree(nullptr), "start");
  check(cudaMemGetInfo(&free_at_start_, &total), "memory");
  check(stream_.create(), "a stream");
}

void check_on_gpu(const std::string& name, Status status, cudaError_t error, const char* step) {
  if (status == Status::kOk) return;
  if (status == Status::kOutOfMemory) throw std::bad_alloc();
  const std::string told = error == cudaSuccess ? "" : std::string(": ") + cudaGetErrorString(error);
  throw GpuError(name + ": " + explain(status) + told, status, step, reason_of(status, error));
}

void GpuEngine::check(Status status, cudaError_t error, const char* step) const {
  if (status == Status::kNoOrientedBlocks) require(status, 0);
  check_on_gpu(name_, status, error, step);
}

void GpuEngine::check(cudaError_t error, const char* step) const {
  check(status_of(error), error, step);
}

void GpuEngine::set_shapes(std::span<const AssetView> shapes) {
  Stopwatch watch;
  shapes_.clear();
  const Status status = uploaded_.upload(shapes, contents_, stream());
  check(status, uploaded_.cuda_error(), "assets");
  check(bounds_.grow(shapes.size()), "instances");
  for (std::size_t i = 0; i < shapes.size(); ++i) {
    shapes_.push_back(gpu_asset(uploaded_.level(i), shapes[i]));
    bounds_.staged.data()[i] = asset_bounds(*shapes[i].header);
  }
  check(bounds_.upload(shapes.size(), stream()), "instances");
  name_shapes();
  check(stream_.wait(), "upload");
  upload_of_shapes_ = watch.lap();
}

void GpuEngine::update(std::span<const BodyPose> bodies) {
  Stopwatch watch;
  check(shape_of_.grow(bodies.size()), "instances");
  check(poses_.grow(bodies.size()), "instances");
  for (std::size_t i = 0; i < bodies.size(); ++i) {
    shape_of_.staged.data()[i] = bodies[i].asset;
    poses_.staged.data()[i] = bodies[i].pose;
  }
  check(shape_of_.upload(bodies.size(), stream()), "instances");
  check(poses_.upload(bodies.size(), stream()), "instances");
  check(stream_.wait(), "upload");
  instances_ = {shape_of_.on_gpu.data(), poses_.on_gpu.data(), static_cast<std::uint32_t>(bodies.size())};
  check(broad_phase_.keep_fixed({}, {}, {}, stream()), broad_phase_.cuda_error(), "broad phase");
  upload_of_bodies_ = watch.lap();
}

void GpuEngine::keep_fixed() {
  if (filter_.motion == nullptr) return;
  const std::span<const Motion> motion(filter_.motion, instances_.count);
  const Status status = broad_phase_.keep_fixed(instances_, bounds(), motion, stream());
  if (subject(status) != nullptr) require(status, broad_phase_.report().where);
  check(status, broad_phase_.cuda_error(), "broad phase");
}

// Where the copy lies; null where there is nothing of each body to copy.
template <typename Element>
const Element* GpuEngine::upload_of_each(const Element* of_each, StagedArray<Element>& array) {
  if (of_each == nullptr) return nullptr;
  check(array.grow(instances_.count), "filter");
  std::copy_n(of_each, instances_.count, array.staged.data());
  check(array.upload(instances_.count, stream()), "filter");
  return array.on_gpu.data();
}

void GpuEngine::upload_filter() {
  check(excluded_.upload(filter_.excluded, stream()), excluded_.cuda_error(), "filter");
  filter_on_gpu_ = {upload_of_each(filter_.motion, motion_), upload_of_each(filter_.group, group_),
                    upload_of_each(filter_.mask, mask_), excluded_.view()};
}

GpuAssetBounds GpuEngine::bounds() const {
  return {bounds_.on_gpu.data(), static_cast<std::uint32_t>(shapes_.size())};
}

GpuBroadPhaseOptions GpuEngine::broad_phase_options(bool sorted) const {
  return {.sorted = sorted, .filter = filter_on_gpu_, .within = within_};
}

// Until there is room for all.
void GpuEngine::find_pairs_on_gpu(bool sorted) {
  upload_filter();
  const Status status = broad_phase_.find_pairs(instances_, bounds(), broad_phase_options(sorted), stream());
  if (subject(status) != nullptr) require(status, broad_phase_.report().where);
  check(status, broad_phase_.cuda_error(), "broad phase");
}

std::span<const ObjectPair> GpuEngine::find_pairs() {
  find_pairs_on_gpu(true);
  const std::uint32_t count = broad_phase_.report().count;
  check(found_pairs_.grow(count), "download");
  const std::span<ObjectPair> pairs(found_pairs_.data(), count);
  check(download(broad_phase_.pairs().pairs, pairs, stream()), "download");
  return pairs;
}

// Queues the copy; ask() waits for it.
GpuPairs GpuEngine::upload(std::span<const ObjectPair> pairs) {
  check(given_pairs_.grow(pairs.size()), "instances");
  check(pair_count_.grow(1), "instances");
  std::copy(pairs.begin(), pairs.end(), given_pairs_.staged.data());
  *pair_count_.staged = static_cast<std::uint32_t>(pairs.size());
  check(given_pairs_.upload(pairs.size(), stream()), "instances");
  check(pair_count_.upload(1, stream()), "instances");
  return {given_pairs_.on_gpu.data(), pair_count_.on_gpu.data(), static_cast<std::uint32_t>(pairs.size())};
}

// Pairs that find_pairs() found, all of them, lie on the GPU already.
void GpuEngine::query(std::span<const ObjectPair> pairs) {
  const bool on_gpu =
      !pairs.empty() && pairs.data() == found_pairs_.data() && pairs.size() == broad_phase_.report().count;
  ask(on_gpu ? broad_phase_.pairs() : upload(pairs), OrderOnGpu::any);
}

bool GpuEngine::contacts(std::vector<TriangleContact>& found_contacts) {
  const GpuContacts on_gpu = found();
  check(contacts_.grow(on_gpu.count), "download");
  const std::span<Contact> contacts(contacts_.data(), on_gpu.count);
  check(download(on_gpu.data, contacts, stream()), "download");
  put(contacts, found_contacts);
  return true;
}

TimedAnswer GpuEngine::time_query(const TimedQuery& asked) {
  if (asked.given == nullptr) {
    keep_fixed();
    find_pairs_on_gpu(asked.order == OrderOnGpu::sorted);
  }
  const GpuPairs pairs = asked.given == nullptr ? broad_phase_.pairs() : upload(*asked.given);
  ask(pairs, order_of_query(asked));
  TimedAnswer answer;
  time_repeats(pairs, asked, answer);
  const GpuContacts contacts = found();
  answer.gpu = use(asked);
  answer.pairs.resize(asked.given == nullptr ? broad_phase_.report().count : pairs.capacity);
  if (asked.manifolds) take_manifolds(answer.manifolds);
  take(pairs, contacts, asked.order, answer);
  if (asked.traversal) answer.traversal = time_walk(pairs, asked.repeats);
  return answer;
}

void GpuEngine::time_repeats(const GpuPairs& pairs, const TimedQuery& asked, TimedAnswer& answer) {
  GpuEvent begin, between, found, end;
  for (GpuEvent* event : {&begin, &between, &found, &end}) check(event->create(), "an event");
  const bool finds_pairs = asked.given == nullptr;
  const Before find_pairs = [&](unsigned) {
    if (!finds_pairs) return;
    const Status status = broad_phase_.enqueue(
        instances_, bounds(), broad_phase_options(asked.order == OrderOnGpu::sorted), stream());
    check(status, broad_phase_.cuda_error(), "broad phase");
  };
  const Before find_and_record = [&](unsigned event_flags) {
    find_pairs(event_flags);
    check(between.record(stream(), event_flags), "an event");
  };
  const Before then = [&](unsigned event_flags) { check(found.record(stream(), event_flags), "an event"); };
  // An event between the steps keeps the second from getting ready while the first ends.
  const std::function<void()> run = asked.manifolds
                                        ? repeatable_with_manifolds(pairs, asked.order, find_pairs, then)
                                        : repeatable(pairs, asked.order, find_pairs),
                              run_in_steps = repeatable(pairs, order_of_query(asked), find_and_record);
  const GpuEvent& end_of_query = asked.manifolds ? found : end;
  for (std::uint32_t i = 0; i < asked.repeats; ++i) {
    if (finds_pairs) {
      run_between(begin, run_in_steps, end);
      answer.narrow.push_back(seconds_between(between, end));
      answer.broad_phase.push_back(seconds_between(begin, between));
    }
    // The last, so that what is there afterwards, manifolds too, is of the same pairs.
    run_between(begin, run, end);
    answer.whole.push_back(seconds_between(begin, end_of_query));
    if (asked.manifolds) answer.manifolds.seconds.push_back(seconds_between(found, end));
    if (!finds_pairs) answer.narrow.push_back(answer.whole.back());
  }
}

std::function<void()> GpuEngine::repeatable_with_manifolds(const GpuPairs&, OrderOnGpu, const Before&,
                                                           const Before&) {
  throw std::logic_error("an engine that makes no manifolds");
}

void GpuEngine::run_between(const GpuEvent& begin, const std::function<void()>& run,
                            const GpuEvent& end) const {
  check(begin.record(stream()), "an event");
  run();
  check(end.record(stream()), "an event");
  check(stream_.wait(), "the query");
}

double GpuEngine::seconds_between(const GpuEvent& begin, const GpuEvent& end) const {
  float milliseconds = 0;
  check(milliseconds_between(begin, end, milliseconds), "time");
  return 1e-3 * static_cast<double>(milliseconds);
}

void GpuEngine::take(const GpuPairs& pairs, const GpuContacts& contacts, OrderOnGpu order,
                     TimedAnswer& answer) const {
  std::vector<Contact> found(contacts.count);
  check(download(contacts.data, std::span(found), stream()), "download");
  check_order(found, order);
  put(found, answer.contacts);
  check(download(pairs.pairs, std::span(answer.pairs), stream()), "download");
  sort_pairs(answer);
}

std::size_t GpuEngine::scene_bytes(const TimedQuery& asked) const {
  return uploaded_.bytes() + shapes_.size() * sizeof(AssetBounds) +
         instances_.count * (sizeof(Pose) + sizeof(std::uint32_t)) + motion_.on_gpu.bytes() +
         group_.on_gpu.bytes() + mask_.on_gpu.bytes() + excluded_.bytes() +
         (asked.given != nullptr ? asked.given->size() * sizeof(ObjectPair) : 0);
}

GpuUse GpuEngine::use(const TimedQuery& asked) const {
  GpuUse use;
  int device = 0;
  cudaDeviceProp properties;
  std::size_t free = 0, total = 0;
  check(cudaMemGetInfo(&free, &total), "memory");
  check(cudaGetDevice(&device), "start");
  check(cudaGetDeviceProperties(&properties, device), "start");
  use.name = properties.name;
  use.upload = upload_of_shapes_ + upload_of_bodies_;
  use.bytes = scene_bytes(asked) + broad_phase_.bytes() + query_bytes();
  use.bytes_bound = most_bytes(asked.order);
  if (use.bytes_bound != 0) {
    use.bytes_bound += scene_bytes(asked);
    if (asked.given == nullptr)
      use.bytes_bound += most_broad_phase_bytes(broad_phase_.capacity(), asked.order == OrderOnGpu::sorted);
  }
  use.bytes_taken = free_at_start_ - free;
  return use;
}

}  // namespace tandem
