#include <algorithm>
#include <memory>
#include <tuple>

#include "gpu_contacts.h"
#include "kernels/contact/only_walk.h"
#include "tandem/kernels/gpu_contact_query.h"
#include "tandem/kernels/gpu_distance_query.h"
#include "tandem/kernels/gpu_impact_query.h"
#include "tandem/kernels/gpu_manifold_query.h"
#include "tandem/kernels/gpu_moved_query.h"
#include "tandem/kernels/gpu_tolerance_query.h"

namespace tandem {
namespace {

template <typename Report>
void check_repeat(const Report& report) {
  if (report.status != Status::kOk || report.complete == 0)
    throw std::runtime_error("the GPU: a repeat of the query found something else than the first");
}

class CudaContacts final : public GpuContactEngine {
 public:
  CudaContacts(std::string_view name, const ContactOptions& options)
      : GpuContactEngine(name,
                         {.contents = options.mode == QueryMode::exact ? Contents::manifolds : Contents::all,
                          .within = options.within}),
        options_(options) {}

  std::string label() const override { return "Tandem GPU"; }
  std::string settings() const override {
    return "on " + gpu_name() + ", timed there: positions, poses and contacts lie in its memory";
  }

 private:
  GpuContactOptions options(OrderOnGpu order) const {
    return {.mode = options_.mode,
            .first_contact_only = options_.first_contact_only,
            .sorted = order == OrderOnGpu::sorted,
            .grouped = order == OrderOnGpu::grouped,
            .within = options_.within,
            .leave_out_rings = options_.leave_out_rings};
  }

  void name_shapes() override { name_shapes_to(query_); }

  void ask(const GpuPairs& pairs, OrderOnGpu order) override {
    const Status status = query_.find_contacts(instances(), pairs, options(order), stream());
    check(status, query_, "contacts");
  }

  GpuContacts found() override {
    check_repeat(query_.report());
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

  // Returns a function that queues both; the contacts are grouped too.
  std::function<void()> repeatable_with_manifolds(const GpuPairs& pairs, OrderOnGpu order,
                                                  const Before& before, const Before& between) override {
    GpuContactOptions with_groups = options(order);
    with_groups.grouped = true;
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

  std::function<void()> repeatable_with_kept_manifolds(const GpuPairs& pairs, double tolerance,
                                                       const Before& before) override {
    const GpuMovedOptions within = {.tolerance = tolerance};
    const GpuContactOptions with_groups = options(OrderOnGpu::grouped);
    require(moved_.set_assets(shapes(), stream()), 0);
    check(moved_.find(instances(), pairs, within, stream()), moved_.cuda_error(), "moved pairs");
    const GpuMoved moved = moved_.moved();
    check(query_.find_contacts(instances(), moved.moved, with_groups, stream()), query_, "contacts");
    check(manifolds_.make(instances(), moved, query_, kOfFeatures, stream()), manifolds_.cuda_error(),
          "manifolds");
    return captured([=, this, &before] {
      before(cudaEventRecordExternal);
      check(moved_.enqueue(instances(), pairs, within, stream()), moved_.cuda_error(), "moved pairs");
      enqueue(query_, moved.moved, with_groups, "contacts");
      check(manifolds_.enqueue(instances(), moved, query_, kOfFeatures, stream()), manifolds_.cuda_error(),
            "manifolds");
    });
  }

  void take_manifolds(TimedManifolds& made) override {
    const GpuManifoldReport& report = manifolds_.report();
    if (report.status != Status::kOk || report.complete == 0)
      throw std::runtime_error("the GPU: a repeat made no manifolds");
    made.manifolds.resize(report.manifolds);
    made.points.resize(report.points);
    made.counters = report.counters;
    check(download(manifolds_.manifolds(), std::span(made.manifolds), stream()), "download");
    check(download(manifolds_.points(), std::span(made.points), stream()), "download");
    if (moved_.capacity().pairs != 0) made.kept_pairs = moved_.report().counters.kept;
  }

  Seconds time_walk(const GpuPairs& pairs, std::uint32_t repeats) override {
    const GpuContactOptions walk_alone = {.within = options_.within,
                                          .leave_out_rings = options_.leave_out_rings};
    GpuContactQuery walk;
    only_walk(walk, true);
    name_shapes_to(walk);
    const Status status =
        walk.reserve({.pairs = static_cast<std::uint32_t>(counters_.object_pairs)}, walk_alone);
    check(status, walk.cuda_error(), "traversal");
    return time_repeats(repeats, captured([&] { enqueue(walk, pairs, walk_alone, "traversal"); }));
  }

  void name_shapes_to(GpuContactQuery& query) const {
    Status status = query.set_assets(shapes(), stream());
    if (status == Status::kOk) status = query.follow(records());
    check(status, query.cuda_error(), "assets");
  }

  void enqueue(GpuContactQuery& query, const GpuPairs& pairs, const GpuContactOptions& options,
               const char* step) {
    const Status status = query.enqueue(instances(), pairs, options, stream());
    check(status, query.cuda_error(), step);
  }

  std::size_t query_bytes() const override { return query_.bytes(); }
  std::size_t most_bytes(OrderOnGpu order) const override {
    return most_query_bytes(query_.capacity(), options(order), shapes().size());
  }

  static constexpr ManifoldOptions kOfFeatures = {.match_previous = false};

  ContactOptions options_;
  GpuContactQuery query_;
  GpuManifoldQuery manifolds_;
  GpuMovedQuery moved_;
};

/// A question that has a row for each pair.
template <typename Query>
class CudaRows : public GpuEngine {
 protected:
  using GpuEngine::GpuEngine;

  void name_shapes() override {
    Status status = set_assets();
    if (status == Status::kOk) status = query_.follow(records());
    check(status, query_.cuda_error(), "assets");
  }

  /// Tell the query of shapes(); find the rows of these pairs, until everything has room; queue that once
  /// more. Without pairs, the query finds them itself.
  virtual Status set_assets() = 0;
  virtual Status find(const GpuPairs& pairs) = 0;
  virtual Status enqueue(const GpuPairs& pairs) = 0;

  /// Makes room for what a repeat may need beyond the first run.
  virtual void make_room_for_repeats() {}

  /// Returns the most GPU memory that the query may take by its own rule.
  virtual std::size_t most_bytes() const = 0;

  /// The pairs that were found, in GPU memory.
  virtual std::span<const ObjectPair> found() const { return {pairs_found().pairs, count_found()}; }

  /// Times the question. step: what it does; rows(): where the rows lie in GPU memory.
  template <typename Timed, typename Rows>
  Timed time(const TimedQuery& asked, const char* step, const Rows& rows) {
    const GpuPairs pairs = pairs_of(asked, true);
    check(find(pairs), query_, step);
    make_room_for_repeats();
    const auto again = [&] { check(enqueue(pairs), query_.cuda_error(), step); };
    Timed out;
    out.narrow = time_repeats(asked.repeats, captured(again));
    out.whole = out.narrow;
    if (has_broad_phase(asked)) {
      const auto both = [&] {
        enqueue_broad_phase(true);
        again();
      };
      out.whole = time_repeats(asked.repeats, captured(both));
    }
    check_repeat(query_.report());
    const std::span<const ObjectPair> answered =
        asked.given == nullptr ? found() : std::span(pairs.pairs, asked.given->size());
    out.counters = query_.report().counters;
    out.pairs.resize(answered.size());
    out.rows.resize(answered.size());
    check(download(answered.data(), std::span(out.pairs), stream()), "download");
    check(download(rows(), std::span(out.rows), stream()), "download");
    out.gpu = use(asked, query_.bytes(), broad_phase().bytes() + most_bytes());
    return out;
  }

  Query query_;
};

class CudaDistances final : public CudaRows<GpuDistanceQuery> {
 public:
  CudaDistances(std::string_view name, const DistanceOptions& options)
      : CudaRows(name, {.within = options.reach}),
        options_{.tolerance = options.tolerance, .reach = options.reach} {}

  TimedDistances time_distances(const TimedQuery& asked) override {
    auto out = time<TimedDistances>(asked, "distances", [&] { return query_.distances(); });
    out.rounds = query_.report().rounds;
    return out;
  }

 private:
  Status set_assets() override { return query_.set_assets(shapes(), stream()); }
  Status find(const GpuPairs& pairs) override {
    return query_.find_distances(instances(), pairs, options_, stream());
  }
  Status enqueue(const GpuPairs& pairs) override {
    return query_.enqueue(instances(), pairs, options_, stream());
  }
  std::size_t most_bytes() const override { return most_distance_bytes(query_.capacity(), shapes().size()); }

  const GpuDistanceOptions options_;
};

// Sorts by a, then b. The CPU does it, as it sorts contacts: it is no part of a step.
void sort(TimedImpacts& found) {
  std::vector<std::pair<ObjectPair, Impact>> rows;
  for (std::size_t i = 0; i < found.pairs.size(); ++i) rows.emplace_back(found.pairs[i], found.rows[i]);
  std::sort(rows.begin(), rows.end(), [](const auto& x, const auto& y) { return x.first < y.first; });
  for (std::size_t i = 0; i < rows.size(); ++i) std::tie(found.pairs[i], found.rows[i]) = rows[i];
}

class CudaImpacts final : public CudaRows<GpuImpactQuery> {
 public:
  CudaImpacts(std::string_view name, const ImpactOptions& options)
      : CudaRows(name, {.finds_pairs = true}), options_{.tolerance = options.tolerance} {}

  TimedImpacts time_impacts(const TimedQuery& asked) override {
    options_.filter = upload_filter();
    auto out = time<TimedImpacts>(asked, "impacts", [&] { return query_.impacts(); });
    out.rounds = query_.report().rounds;
    if (asked.given == nullptr) sort(out);
    return out;
  }

 private:
  Status set_assets() override { return query_.set_assets(shapes(), stream()); }
  Status find(const GpuPairs& pairs) override {
    if (pairs.count == nullptr)
      return query_.find(instances(), motion_on_gpu(), duration_, options_, stream());
    return query_.find(instances(), motion_on_gpu(), duration_, pairs, options_, stream());
  }
  Status enqueue(const GpuPairs& pairs) override {
    if (pairs.count == nullptr)
      return query_.enqueue(instances(), motion_on_gpu(), duration_, options_, stream());
    return query_.enqueue(instances(), motion_on_gpu(), duration_, pairs, options_, stream());
  }
  std::size_t most_bytes() const override {
    return most_impact_bytes(query_.capacity(), shapes().size(), false);
  }
  std::span<const ObjectPair> found() const override {
    return {query_.pairs().pairs, query_.report().impacts};
  }

  GpuImpactOptions options_;
};

class CudaVerdicts final : public CudaRows<GpuToleranceQuery> {
 public:
  CudaVerdicts(std::string_view name, const ToleranceOptions& options)
      : CudaRows(name, {.contents = Contents::exact_queries, .all_levels = true}),
        tolerance_(options.tolerance) {}

  TimedVerdicts time_verdicts(const TimedQuery& asked) override {
    return time<TimedVerdicts>(asked, "verdicts", [&] { return query_.verdicts(); });
  }

 private:
  Status set_assets() override { return query_.set_assets(shapes(), stream()); }
  Status find(const GpuPairs& pairs) override {
    return query_.decide(instances(), pairs, tolerance_, stream());
  }
  Status enqueue(const GpuPairs& pairs) override {
    return query_.enqueue(instances(), pairs, tolerance_, stream());
  }
  // The work before a pair's first contact is found differs from run to run.
  void make_room_for_repeats() override {
    GpuToleranceCapacity room = query_.report().needed;
    room.undecided += room.undecided / 2 + 1024;
    check(query_.reserve(room), query_.cuda_error(), "room");
  }
  std::size_t most_bytes() const override { return most_tolerance_bytes(query_.capacity(), shapes().size()); }

  const double tolerance_;
};

}  // namespace

std::unique_ptr<Engine> make_tandem_cuda(std::string_view name, const Question& question) {
  return make_for<CudaContacts, CudaDistances, CudaImpacts, CudaVerdicts>(question, name);
}

}  // namespace tandem
