#pragma once
#include <atomic>
#include <optional>

#include "scene.h"

namespace tandem::python {

/// A turn at what takes one call at a time: a second thread gets RuntimeError.
class Turn {
 public:
  explicit Turn(std::atomic<bool>& busy);
  ~Turn() { busy_ = false; }
  Turn(const Turn&) = delete;
  Turn& operator=(const Turn&) = delete;

 private:
  std::atomic<bool>& busy_;
};

/// Deletes a handle of the C interface on its device.
template <typename Of, void (*destroy)(Of*)>
struct Destroy {
  int device;
  void operator()(Of* handle) const {
    const OnDevice current(device);
    destroy(handle);
  }
};

/// Handles of one kind. Arrays of results lie in a handle's memory and keep it: it is used again when the
/// last of them is gone, and until then a call takes another.
template <typename Of, tandem_status (*create)(const tandem_allocator*, Of**), void (*destroy)(Of*)>
class Pool {
 public:
  using Pointer = std::shared_ptr<Of>;

  /// set_assets: what names its assets to a new one.
  template <typename SetAssets>
  Pointer take(int device, const SetAssets& set_assets) {
    for (const Pointer& made : all_) {
      if (made.use_count() == 1) return made;
    }
    Pointer made = make(device, set_assets);
    all_.push_back(made);
    return made;
  }

  /// One that is not in the pool.
  template <typename SetAssets>
  static Pointer make(int device, const SetAssets& set_assets) {
    Of* handle = nullptr;
    check_whole(create(nullptr, &handle));
    Pointer made(handle, Destroy<Of, destroy>{device});
    check_whole(set_assets(handle));
    return made;
  }

 private:
  std::vector<Pointer> all_;
};

template <typename Options>
Options sized() {
  Options options = {};
  options.struct_size = sizeof options;
  return options;
}

using BroadPhases =
    Pool<tandem_gpu_broad_phase, tandem_gpu_broad_phase_create, tandem_gpu_broad_phase_destroy>;
using ContactQueries =
    Pool<tandem_gpu_contact_query, tandem_gpu_contact_query_create, tandem_gpu_contact_query_destroy>;
using DistanceQueries =
    Pool<tandem_gpu_distance_query, tandem_gpu_distance_query_create, tandem_gpu_distance_query_destroy>;
using ImpactQueries =
    Pool<tandem_gpu_impact_query, tandem_gpu_impact_query_create, tandem_gpu_impact_query_destroy>;
using ToleranceQueries =
    Pool<tandem_gpu_tolerance_query, tandem_gpu_tolerance_query_create, tandem_gpu_tolerance_query_destroy>;
using ManifoldMakers = Pool<tandem_gpu_manifolds, tandem_gpu_manifolds_create, tandem_gpu_manifolds_destroy>;
using ContainmentQueries = Pool<tandem_gpu_containment_query, tandem_gpu_containment_query_create,
                                tandem_gpu_containment_query_destroy>;

/// Object pairs that a call works on, and what keeps them.
struct FoundPairs {
  tandem_gpu_pairs pairs = {};
  std::shared_ptr<const void> owner;
  std::size_t count = 0;
};

/// How a call looks for contacts.
struct ContactOptions {
  tandem_gpu_query_options query;
  bool sorted;
};

class Query {
 public:
  explicit Query(nb::object assets) : assets_object_(assets), assets_(nb::cast<const Assets&>(assets)) {}

  nb::tuple contacts(nb::object instances, nb::object pairs, std::uint32_t mode, bool first_contact_only,
                     double within, bool add_error_bounds, bool sorted, bool grouped, const GpuFilter* filter,
                     const Stream& stream);
  nb::object pairs(nb::object instances, bool sorted, double within, const GpuFilter* filter,
                   const Stream& stream);
  nb::tuple manifolds(std::uint32_t most_points, bool match_previous);
  nb::tuple contained();
  nb::tuple distances(nb::object instances, nb::object pairs, std::optional<double> reach, double absolute,
                      double relative, const GpuFilter* filter, const Stream& stream);
  nb::tuple impacts(nb::object instances, nb::object motion, double duration, nb::object pairs,
                    double tolerance, bool sorted, const GpuFilter* filter, const Stream& stream);
  nb::tuple verdicts(nb::object instances, double tolerance, nb::object pairs, const GpuFilter* filter,
                     const Stream& stream);

  int device() const { return assets_.device(); }
  const Assets& assets() const { return assets_; }

 private:
  // What manifolds and contained bodies follow from.
  struct Last {
    nb::object instances, given;
    FoundPairs pairs;
    std::shared_ptr<tandem_gpu_contact_query> contacts;
    Stream stream;
  };

  FoundPairs find_pairs(const Instances& bodies, bool sorted, double within, const GpuFilter* filter,
                        const Stream& stream);
  FoundPairs pairs_of(nb::handle given, const Instances& bodies, bool sorted, double within,
                      const GpuFilter* filter, const Stream& stream);
  Memory memory_of(std::shared_ptr<const void> owner, const Stream& stream) const {
    return {std::move(owner), device(), stream, true};
  }
  Rows rows_of(const FoundPairs& pairs, const Stream& stream) const;
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
  ManifoldMakers::Pointer manifolds_;
  ContainmentQueries::Pointer contained_;
  std::vector<std::shared_ptr<Buffer>> copies_;
  std::optional<Last> last_;
};

/// A step with room for a given scene, which is queued and never waits.
class Step {
 public:
  Step(nb::object assets, std::uint32_t instances, std::uint32_t pairs, std::uint64_t contacts,
       std::uint64_t undecided, std::uint32_t mode, bool first_contact_only, double within,
       bool add_error_bounds, bool sorted, bool grouped);
  void enqueue(nb::object instances, nb::object pairs, nb::object filter, const Stream& stream);
  Rows pairs() const;
  Array pair_count() const;
  Rows contacts() const;
  Rows report() const;
  Array first_contact() const;
  /// given: the pairs of the call that is waited for, or None. stream: null: that of the last call, or, where
  /// a call was captured, all of the device's, since its graph may run on any.
  nb::tuple wait(nb::handle given, const Stream* stream);

 private:
  Memory memory_of(std::shared_ptr<const void> owner) const {
    return {std::move(owner), assets_.device(), stream_, false};
  }

  nb::object assets_object_;
  const Assets& assets_;
  BroadPhases::Pointer broad_phase_;
  ContactQueries::Pointer contacts_;
  tandem_gpu_query_options options_;
  tandem_gpu_broad_phase_options near_;
  std::uint64_t contact_room_;
  std::atomic<bool> busy_ = false;
  Stream stream_;
  bool captured_ = false;
  nb::object instances_, given_, filter_;  // what the stream may still read
};

}  // namespace tandem::python
