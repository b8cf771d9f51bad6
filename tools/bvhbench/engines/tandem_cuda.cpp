#include <memory>

#include "gpu_engine.h"
#include "kernels/contact/only_walk.h"
#include "tandem/formats/gpu_memory.h"
#include "tandem/kernels/gpu_contact_query.h"
#include "tandem/kernels/gpu_manifold_query.h"

namespace tandem {
namespace {

/// Tandem on the GPU.
class TandemCudaEngine final : public GpuEngine {
 public:
  explicit TandemCudaEngine(const ContactOptions& options)
      : GpuEngine("tandem-cuda", options.mode == QueryMode::exact ? Contents::manifolds : Contents::all,
                  options.within),
        options_(options) {}

 private:
  GpuContactOptions options(OrderOnGpu order) const {
    return {.mode = options_.mode,
            .first_contact_only = options_.first_contact_only,
            .sorted = order == OrderOnGpu::sorted,
            .grouped = order == OrderOnGpu::grouped,
            .within = options_.within};
  }

  void name_shapes() override { name_shapes_to(query_); }

  void ask(const GpuPairs& pairs, OrderOnGpu order) override {
    const Status status = query_.find_contacts(instances(), pairs, options(order), stream());
    if (subject(status) != nullptr) require(status, query_.report().where);
    check(status, query_.cuda_error(), "contacts");
  }

  GpuContacts found() override {
    if (query_.report().status != Status::kOk || query_.report().complete == 0) {
      throw std::runtime_error("the GPU: a repeat of the query found something else than the first");
    }
    counters_ = query_.report().counters;
    return {query_.contacts(), query_.report().contacts};
  }

  // A graph that is replayed.
  std::function<void()> repeatable(const GpuPairs& pairs, OrderOnGpu order, const Before& before) override {
    return captured([=, this, &before] {
      before(cudaEventRecordExternal);
      enqueue(query_, pairs, options(order), "contacts");
    });
  }

  // Both: their contacts are grouped too.
  std::function<void()> repeatable_with_manifolds(const GpuPairs& pairs, OrderOnGpu order,
                                                  const Before& before, const Before& between) override {
    GpuContactOptions with_groups = options(order);
    with_groups.grouped = true;
    constexpr GpuManifoldOptions kOfFeatures = {.match_previous = false};
    check(query_.reserve(query_.capacity(), with_groups), query_.cuda_error(), "contacts");
    enqueue(query_, pairs, with_groups, "contacts");
    check(cudaStreamSynchronize(stream()), "contacts");
    require(manifolds_.set_assets(shapes(), stream()), 0);
    const Status status = manifolds_.make(instances(), pairs, query_, kOfFeatures, stream());
    check(status, manifolds_.cuda_error(), "manifolds");
    return captured([=, this, &before, &between] {
      before(cudaEventRecordExternal);
      enqueue(query_, pairs, with_groups, "contacts");
      between(cudaEventRecordExternal);
      check(manifolds_.enqueue(instances(), pairs, query_, kOfFeatures, stream()), manifolds_.cuda_error(),
            "manifolds");
    });
  }

  void take_manifolds(TimedManifolds& made) override {
    const GpuManifoldReport& report = manifolds_.report();
    made.manifolds.resize(report.manifolds);
    made.points.resize(report.points);
    made.counters = report.counters;
    check(download(manifolds_.manifolds(), std::span(made.manifolds), stream()), "download");
    check(download(manifolds_.points(), std::span(made.points), stream()), "download");
  }

  Seconds time_walk(const GpuPairs& pairs, std::uint32_t repeats) override {
    const GpuContactOptions walk_alone = {.within = options_.within};
    GpuContactQuery walk;
    only_walk(walk, true);
    name_shapes_to(walk);
    const Status status =
        walk.reserve({.pairs = static_cast<std::uint32_t>(counters_.object_pairs)}, walk_alone);
    check(status, walk.cuda_error(), "traversal");
    const auto run = captured([&] { enqueue(walk, pairs, walk_alone, "traversal"); });
    GpuEvent begin, end;
    for (GpuEvent* event : {&begin, &end}) check(event->create(), "an event");
    Seconds seconds;
    for (std::uint32_t i = 0; i < repeats; ++i) {
      run_between(begin, run, end);
      seconds.push_back(seconds_between(begin, end));
    }
    return seconds;
  }

  void name_shapes_to(GpuContactQuery& query) const {
    const Status status = query.set_assets(shapes(), stream());
    check(status, query.cuda_error(), "assets");
  }

  void enqueue(GpuContactQuery& query, const GpuPairs& pairs, const GpuContactOptions& options,
               const char* step) {
    const Status status = query.enqueue(instances(), pairs, options, stream());
    check(status, query.cuda_error(), step);
  }

  std::function<void()> captured(const std::function<void()>& work) {
    const auto graph = std::make_shared<GpuGraph>();
    check(graph->capture(stream(), work), "a graph");
    return [this, graph] { check(graph->launch(stream()), "a graph"); };
  }

  std::size_t query_bytes() const override { return query_.bytes(); }
  std::size_t most_bytes(OrderOnGpu order) const override {
    return most_query_bytes(query_.capacity(), options(order), shapes().size());
  }

  ContactOptions options_;
  GpuContactQuery query_;
  GpuManifoldQuery manifolds_;
};

}  // namespace

std::unique_ptr<Engine> make_tandem_cuda(const ContactOptions& options) {
  return std::make_unique<TandemCudaEngine>(options);
}

}  // namespace tandem
