#pragma once
#include <atomic>
#include <optional>

#include "scene.h"

namespace tandem::python {

/// Deletes a handle of the C interface on its device.
template <typename Of, void (*destroy)(Of*)>
struct Destroy {
  int device;
  void operator()(Of* handle) const {
    const OnDevice current(device);
    destroy(handle);
  }
};

/// Returns the report of a call that the stream has passed. Throws what is wrong, with the number to blame.
template <typename Of, typename Report>
Report checked_report(tandem_status (*get_report)(const Of*, Report*), const Of* handle) {
  Report report = {};
  const tandem_status status = get_report(handle, &report);
  check(status, report.where);
  return report;
}

/// A question's handles. Arrays of results lie in a handle's memory and keep it: it is used again when the
/// last of them is gone, and until then a call takes another.
template <auto create, auto destroy, auto set_assets, auto get_report>
class Pool;

template <typename Of, typename Report, tandem_status (*create)(const tandem_allocator*, Of**),
          void (*destroy)(Of*), auto set_assets, tandem_status (*get_report)(const Of*, Report*)>
class Pool<create, destroy, set_assets, get_report> {
 public:
  using Pointer = std::shared_ptr<Of>;

  Pointer take(const Assets& assets, const Stream& stream) {
    for (const Pointer& made : all_) {
      if (made.use_count() == 1) return made;
    }
    all_.push_back(make(assets, stream));
    return all_.back();
  }

  /// Makes a query that is not in the pool.
  static Pointer make(const Assets& assets, const Stream& stream) {
    Of* handle = nullptr;
    check_whole(create(nullptr, &handle));
    Pointer made(handle, Destroy<Of, destroy>{assets.device()});
    if constexpr (requires { set_assets(handle, assets.get()); }) {
      check_whole(set_assets(handle, assets.get()));
    } else {
      check_whole(set_assets(handle, assets.get(), stream));
    }
    return made;
  }

  /// Makes a call that waits for the GPU while other Python threads run. Returns its report; throws what is
  /// wrong, with the number to blame that the report has.
  template <typename Call>
  static Report run(const Pointer& handle, const Call& call) {
    const tandem_status status = [&] {
      const WithoutLock other_threads_run;
      return call(handle.get());
    }();
    Report report = {};
    static_cast<void>(get_report(handle.get(), &report));
    if constexpr (requires { report.where; }) {
      check(status, report.where);
    } else {
      check_whole(status);
    }
    return report;
  }

 private:
  std::vector<Pointer> all_;
};

#define TANDEM_POOL(handle) Pool<handle##_create, handle##_destroy, handle##_set_assets, handle##_get_report>
using BroadPhases = TANDEM_POOL(tandem_gpu_broad_phase);
using ContactQueries = TANDEM_POOL(tandem_gpu_contact_query);
using DistanceQueries = TANDEM_POOL(tandem_gpu_distance_query);
using ImpactQueries = TANDEM_POOL(tandem_gpu_impact_query);
using ProbeQueries = TANDEM_POOL(tandem_gpu_probe_query);
using ToleranceQueries = TANDEM_POOL(tandem_gpu_tolerance_query);
using ManifoldMakers = TANDEM_POOL(tandem_gpu_manifolds);
using ContainmentQueries = TANDEM_POOL(tandem_gpu_containment_query);
#undef TANDEM_POOL

/// Object pairs that a call works on, and what keeps them.
struct FoundPairs {
  tandem_gpu_pairs pairs = {};
  std::shared_ptr<const void> owner;
  std::size_t count = 0;
};

/// Probes of the world, somebody's arrays, and what is asked about them by these functions of C.
template <typename Options, auto find_probes, auto enqueue_probes, auto rows_of>
class Probes {
 public:
  tandem_status find(tandem_gpu_probe_query* query, const Instances& bodies, const Stream& stream) const {
    return find_probes(query, &bodies.get(), &options_, stream);
  }
  tandem_status enqueue(tandem_gpu_probe_query* query, const Instances& bodies, const Stream& stream) const {
    return enqueue_probes(query, &bodies.get(), &options_, stream);
  }
  static auto rows(const tandem_gpu_probe_query* query) { return rows_of(query); }

 protected:
  Options options_ = sized<Options>();
};

class Points : public Probes<tandem_gpu_closest_options, tandem_gpu_probe_query_find_closest,
                             tandem_gpu_probe_query_enqueue_closest, tandem_gpu_probe_query_closest> {
 public:
  Points(nb::handle points, std::optional<double> reach, double absolute, double relative, bool sides,
         const Stream& stream, int device);
  /// Returns the rows that there is room for, where `hits` were reserved.
  std::uint32_t row_room(std::uint32_t) const { return options_.point_count; }

 private:
  GivenArray points_;
};

class Rays : public Probes<tandem_gpu_ray_options, tandem_gpu_probe_query_find_rays,
                           tandem_gpu_probe_query_enqueue_rays, tandem_gpu_probe_query_rays> {
 public:
  Rays(nb::handle origins, nb::handle directions, std::optional<double> reach, std::uint32_t hits,
       const Stream& stream, int device);
  /// Returns what Points::row_room() does.
  std::uint32_t row_room(std::uint32_t hits) const {
    return options_.hits == TANDEM_ALL_HITS ? hits : options_.ray_count;
  }

 private:
  GivenArray origins_, directions_;
};

class Query {
 public:
  explicit Query(nb::object assets) : assets_object_(assets), assets_(nb::cast<const Assets&>(assets)) {}

  nb::tuple contacts(nb::object instances, nb::object pairs, std::uint32_t mode, bool first_contact_only,
                     double within, bool add_error_bounds, std::uint32_t leave_out_rings, bool sorted,
                     bool grouped, const GpuFilter* filter, const Stream& stream);
  nb::object pairs(nb::object instances, bool sorted, double within, const GpuFilter* filter,
                   const Stream& stream);
  nb::tuple manifolds(std::uint32_t most_points, bool match_previous, bool quick_depths);
  nb::tuple contained();
  nb::tuple distances(nb::object instances, nb::object pairs, std::optional<double> reach, double absolute,
                      double relative, const GpuFilter* filter, const Stream& stream);
  nb::tuple impacts(nb::object instances, nb::object motion, double duration, nb::object pairs,
                    double tolerance, bool sorted, const GpuFilter* filter, const Stream& stream);
  nb::tuple verdicts(nb::object instances, double tolerance, nb::object pairs, const GpuFilter* filter,
                     const Stream& stream);

  /// This is about Points or Rays, by Of.
  template <typename Of>
  Rows probe(nb::object instances, const Of& probes, const Stream& stream);

  int device() const { return assets_.device(); }
  const Assets& assets() const { return assets_; }

 private:
  // The last call, from which manifolds and contained bodies follow.
  struct Last {
    nb::object instances, given;
    FoundPairs pairs;
    ContactQueries::Pointer contacts;
    Stream stream;
  };

  FoundPairs find_pairs(const Instances& bodies, bool sorted, double within, const GpuFilter* filter,
                        const Stream& stream);
  FoundPairs pairs_of(nb::handle given, const Instances& bodies, bool sorted, double within,
                      const GpuFilter* filter, const Stream& stream);
  Memory memory_of(std::shared_ptr<const void> owner, const Stream& stream) const {
    return {std::move(owner), device(), stream, true};
  }
  /// The rows of pairs that were found; None where they were given.
  nb::object rows_of(const FoundPairs& pairs, const Stream& stream) const;
  Rows copy(const void* rows, std::size_t count, std::size_t row_bytes, const Stream& stream);
  const Last& last() const;

  nb::object assets_object_;
  const Assets& assets_;
  std::atomic<bool> busy_ = false;
  BroadPhases broad_phases_;
  ContactQueries contact_queries_;
  DistanceQueries distance_queries_;
  ImpactQueries impact_queries_;
  ToleranceQueries tolerance_queries_;
  ProbeQueries probe_queries_;
  ManifoldMakers::Pointer manifolds_;
  ContainmentQueries::Pointer contained_;
  std::vector<std::shared_ptr<Buffer>> copies_;
  std::optional<Last> last_;
};

/// The room for manifolds of a step, and how they are made.
struct ManifoldRoom {
  std::uint32_t manifolds = 0, points = 0;  ///< 0 manifolds: the step makes none
  std::uint32_t most_points = 0;
  bool match_previous = false;
};

/// The base of what is queued with room for a given scene, and never waits.
class QueuedCalls {
 protected:
  explicit QueuedCalls(nb::object assets)
      : assets_object_(assets), assets_(nb::cast<const Assets&>(assets)) {}

  /// Says that a call is about to be queued, or captured, on this stream.
  void begin(const Stream& stream);
  /// Waits for `stream`; null: for that of the last call, or, where a call was captured, for all of the
  /// device's, since its graph may run on any. Throws what was wrong with positions that were queued.
  void synchronize(const Stream* stream) const;
  Memory memory_of(std::shared_ptr<const void> owner) const {
    return {std::move(owner), assets_.device(), stream_, false};
  }

  nb::object assets_object_;
  const Assets& assets_;
  std::atomic<bool> busy_ = false;

 private:
  Stream stream_;
  bool captured_ = false;
};

/// Points and rays that are queued.
class ProbeStep : QueuedCalls {
 public:
  ProbeStep(nb::object assets, std::uint32_t instances, std::uint32_t probes, std::uint32_t hits,
            std::uint32_t words);
  /// Returns the room of the rows. Of, and `probes`: Points or Rays.
  template <typename Of>
  Rows enqueue(nb::object instances, nb::object probes, const Stream& stream);
  Rows report() const;
  /// Does what Step::wait() does.
  nb::tuple wait(const Stream* stream);

 private:
  ProbeQueries::Pointer query_;
  std::uint32_t hit_room_;
  nb::object instances_, probes_;  // what the stream may still read
};

/// A step of contacts that is queued.
class Step : QueuedCalls {
 public:
  Step(nb::object assets, std::uint32_t instances, std::uint32_t pairs, std::uint64_t contacts,
       std::uint64_t undecided, std::uint32_t mode, bool first_contact_only, double within,
       bool add_error_bounds, std::uint32_t leave_out_rings, bool sorted, bool grouped);
  /// Lets calls make manifolds too. Condition: contacts are grouped, and nothing is queued.
  void reserve_manifolds(std::uint32_t manifolds, std::uint32_t points, std::uint32_t most_points,
                         bool match_previous);
  void enqueue(nb::object instances, nb::object pairs, nb::object filter, const Stream& stream);
  Rows pairs() const;
  Array pair_count() const;
  Rows contacts() const;
  Rows report() const;
  Array first_contact() const;
  Rows manifolds() const;
  Rows points() const;
  Rows manifold_report() const;
  /// given: the pairs of the call that is waited for, or None. stream: as of synchronize().
  nb::tuple wait(nb::handle given, const Stream* stream);

 private:
  void require_manifolds() const;

  BroadPhases::Pointer broad_phase_;
  ContactQueries::Pointer contacts_;
  ManifoldMakers::Pointer manifolds_;  // null: none are made
  tandem_gpu_query_options options_;
  tandem_gpu_broad_phase_options near_;
  std::uint32_t pair_room_;
  std::uint64_t contact_room_;
  ManifoldRoom manifold_room_;
  nb::object instances_, given_, filter_;  // what the stream may still read
};

}  // namespace tandem::python
