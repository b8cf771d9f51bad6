#include <nanobind/stl/vector.h>

#include <atomic>
#include <memory>
#include <utility>

#include "core.h"

namespace tandem::python {
namespace {

// A handle of the C interface that is made when it is first needed.
template <typename Of, tandem_status (*create)(const tandem_allocator*, Of**), void (*destroy)(Of*),
          tandem_status (*set_assets)(Of*, tandem_asset* const*, std::size_t),
          std::uint64_t (*where)(const Of*)>
class Lazy {
 public:
  ~Lazy() { destroy(query_); }
  Of* get(const std::vector<tandem_asset*>& assets) {
    if (query_ != nullptr) return query_;
    Of* made = nullptr;
    check(create(nullptr, &made));
    std::unique_ptr<Of, decltype(destroy)> owner(made, destroy);
    const tandem_status status = set_assets(made, assets.data(), assets.size());
    check(status, where(made));
    return query_ = owner.release();
  }

 private:
  Of* query_ = nullptr;
};

template <typename Options>
Options sized() {
  Options options = {};
  options.struct_size = sizeof options;
  return options;
}

using Instances = std::vector<tandem_instance>;

// The object pairs that a call is told of, or none where the query is to find them.
struct GivenPairs {
  bool given;
  std::vector<tandem_object_pair> rows;
  explicit GivenPairs(nb::handle pairs) : given(!pairs.is_none()) {
    if (given) rows = copy_rows<tandem_object_pair>(pairs);
  }
};

class Query {
 public:
  explicit Query(nb::list assets) {
    for (nb::handle asset : assets) assets_.push_back(nb::cast<const Asset&>(asset).get());
    for (tandem_asset* asset : assets_) tandem_asset_retain(asset);
  }
  ~Query() {
    for (tandem_asset* asset : assets_) tandem_asset_release(asset);
  }
  Query(const Query&) = delete;
  Query& operator=(const Query&) = delete;

  nb::tuple contacts(nb::handle instances, nb::handle pairs, std::uint32_t mode, bool first_contact_only,
                     bool self_pairs, double within, bool add_error_bounds, const Filter* filter,
                     std::uint32_t threads) {
    const Turn turn(*this);
    tandem_contact_query* query = contacts_.get(assets_);
    instances_ = copy_rows<tandem_instance>(instances);
    const GivenPairs given(pairs);
    auto options = sized<tandem_query_options>();
    options.mode = mode;
    options.first_contact_only = first_contact_only;
    options.self_pairs = self_pairs;
    options.threads = threads;
    options.add_error_bounds = add_error_bounds;
    options.within = within;
    options.filter = Filter::of(filter);
    run(
        [&] {
          return given.given ? tandem_contact_query_find_contacts_of_pairs(
                                   query, instances_.data(), instances_.size(), given.rows.data(),
                                   given.rows.size(), &options)
                             : tandem_contact_query_find_contacts(query, instances_.data(), instances_.size(),
                                                                  &options);
        },
        [&] { return tandem_contact_query_where(query); });
    auto counters = sized<tandem_query_counters>();
    check(tandem_contact_query_get_counters(query, &counters));
    return nb::make_tuple(rows<tandem_contact_query_pairs>(query), rows<tandem_contact_query_contacts>(query),
                          nb::make_tuple(counters.object_pairs, counters.block_pairs, counters.candidates,
                                         counters.decided_by_float32, counters.decided_by_float64,
                                         counters.decided_exactly, counters.contacts));
  }

  nb::object pairs(nb::handle instances, bool self_pairs, double within, bool add_error_bounds,
                   const Filter* filter, std::uint32_t threads) {
    const Turn turn(*this);
    tandem_contact_query* query = contacts_.get(assets_);
    instances_ = copy_rows<tandem_instance>(instances);
    auto options = sized<tandem_query_options>();
    options.self_pairs = self_pairs;
    options.threads = threads;
    options.add_error_bounds = add_error_bounds;
    options.within = within;
    options.filter = Filter::of(filter);
    run(
        [&] {
          return tandem_contact_query_find_pairs(query, instances_.data(), instances_.size(), &options);
        },
        [&] { return tandem_contact_query_where(query); });
    return rows<tandem_contact_query_pairs>(query);
  }

  void keep_fixed(nb::handle instances, nb::handle motion, std::uint32_t threads) {
    const Turn turn(*this);
    tandem_contact_query* query = contacts_.get(assets_);
    instances_ = copy_rows<tandem_instance>(instances);
    const auto motions = copy_rows<std::uint8_t>(motion);
    run(
        [&] {
          return tandem_contact_query_keep_fixed(query, instances_.data(), motions.data(), motions.size(),
                                                 threads);
        },
        [&] { return tandem_contact_query_where(query); });
  }

  nb::tuple manifolds(std::uint32_t most_points, bool match_previous, std::uint32_t threads) {
    const Turn turn(*this);
    tandem_contact_query* query = contacts_.get(assets_);
    auto options = sized<tandem_manifold_options>();
    options.most_points = most_points;
    options.ignore_previous = !match_previous;
    options.threads = threads;
    run(
        [&] {
          return tandem_contact_query_make_manifolds(query, instances_.data(), instances_.size(), &options);
        },
        [&] { return tandem_contact_query_where(query); });
    return nb::make_tuple(rows<tandem_contact_query_pairs>(query),
                          rows<tandem_contact_query_manifolds>(query),
                          rows<tandem_contact_query_points>(query));
  }

  nb::tuple contained(std::uint32_t threads) {
    const Turn turn(*this);
    tandem_contact_query* query = contacts_.get(assets_);
    run(
        [&] {
          return tandem_contact_query_find_contained(query, instances_.data(), instances_.size(), threads);
        },
        [&] { return tandem_contact_query_where(query); });
    return nb::make_tuple(rows<tandem_contact_query_pairs>(query),
                          rows<tandem_contact_query_contained>(query));
  }

  nb::tuple distances(nb::handle instances, nb::handle pairs, nb::handle reach, double absolute_tolerance,
                      double relative_tolerance, const Filter* filter, nb::handle former,
                      std::uint32_t threads) {
    const Turn turn(*this);
    tandem_distance_query* query = distances_.get(assets_);
    const auto posed = copy_rows<tandem_instance>(instances);
    const GivenPairs given(pairs);
    std::vector<tandem_former_nearest> nearest;
    if (!former.is_none()) nearest = copy_rows<tandem_former_nearest>(former);
    auto options = sized<tandem_distance_options>();
    options.threads = threads;
    options.limit_reach = !reach.is_none();
    options.reach = reach.is_none() ? 0 : nb::cast<double>(reach);
    options.absolute_tolerance = absolute_tolerance;
    options.relative_tolerance = relative_tolerance;
    options.filter = Filter::of(filter);
    options.former = nearest.empty() ? nullptr : nearest.data();
    options.former_count = nearest.size();
    run(
        [&] {
          return given.given
                     ? tandem_distance_query_find_of_pairs(query, posed.data(), posed.size(),
                                                           given.rows.data(), given.rows.size(), &options)
                     : tandem_distance_query_find(query, posed.data(), posed.size(), &options);
        },
        [&] { return tandem_distance_query_where(query); });
    return nb::make_tuple(rows<tandem_distance_query_pairs>(query),
                          rows<tandem_distance_query_distances>(query));
  }

  nb::tuple impacts(nb::handle instances, nb::handle motion, double duration, nb::handle pairs,
                    double tolerance, const Filter* filter, std::uint32_t threads) {
    const Turn turn(*this);
    tandem_impact_query* query = impacts_.get(assets_);
    const auto posed = copy_rows<tandem_instance>(instances);
    const auto motions = copy_rows<tandem_motion>(motion);
    if (motions.size() != posed.size()) throw_broken_rows();
    const GivenPairs given(pairs);
    auto options = sized<tandem_impact_options>();
    options.threads = threads;
    options.tolerance = tolerance;
    options.filter = Filter::of(filter);
    run(
        [&] {
          return given.given ? tandem_impact_query_find_of_pairs(query, posed.data(), motions.data(),
                                                                 posed.size(), duration, given.rows.data(),
                                                                 given.rows.size(), &options)
                             : tandem_impact_query_find(query, posed.data(), motions.data(), posed.size(),
                                                        duration, &options);
        },
        [&] { return tandem_impact_query_where(query); });
    return nb::make_tuple(rows<tandem_impact_query_pairs>(query), rows<tandem_impact_query_impacts>(query));
  }

  nb::tuple verdicts(nb::handle instances, double tolerance, nb::handle pairs, const Filter* filter,
                     std::uint32_t threads) {
    const Turn turn(*this);
    tandem_tolerance_query* query = verdicts_.get(assets_);
    const auto posed = copy_rows<tandem_instance>(instances);
    const GivenPairs given(pairs);
    auto options = sized<tandem_tolerance_options>();
    options.threads = threads;
    options.tolerance = tolerance;
    options.filter = Filter::of(filter);
    run(
        [&] {
          return given.given
                     ? tandem_tolerance_query_decide_pairs(query, posed.data(), posed.size(),
                                                           given.rows.data(), given.rows.size(), &options)
                     : tandem_tolerance_query_decide(query, posed.data(), posed.size(), &options);
        },
        [&] { return tandem_tolerance_query_where(query); });
    return nb::make_tuple(rows<tandem_tolerance_query_pairs>(query),
                          rows<tandem_tolerance_query_verdicts>(query));
  }

 private:
  // One call at a time, whichever threads make them: the C interface asks for it.
  class Turn {
   public:
    explicit Turn(Query& query) : busy_(query.busy_) {
      if (busy_.exchange(true)) throw std::runtime_error("another thread is in a call of this query");
    }
    ~Turn() { busy_ = false; }
    Turn(const Turn&) = delete;
    Turn& operator=(const Turn&) = delete;

   private:
    std::atomic<bool>& busy_;
  };

  // The call itself, without the interpreter's lock.
  template <typename Call, typename Where>
  static void run(const Call& call, const Where& where) {
    const tandem_status status = [&] {
      const WithoutLock other_threads_run;
      return call();
    }();
    if (status != TANDEM_OK) check(status, where());
  }

  template <auto get, typename Of>
  static nb::object rows(const Of* query) {
    std::size_t count;
    const auto* first = get(query, &count);
    return to_python(first, count);
  }

  std::vector<tandem_asset*> assets_;
  Instances instances_;  // of the last contacts or pairs, which manifolds and contained bodies are of
  std::atomic<bool> busy_ = false;
  Lazy<tandem_contact_query, tandem_contact_query_create, tandem_contact_query_destroy,
       tandem_contact_query_set_assets, tandem_contact_query_where>
      contacts_;
  Lazy<tandem_distance_query, tandem_distance_query_create, tandem_distance_query_destroy,
       tandem_distance_query_set_assets, tandem_distance_query_where>
      distances_;
  Lazy<tandem_impact_query, tandem_impact_query_create, tandem_impact_query_destroy,
       tandem_impact_query_set_assets, tandem_impact_query_where>
      impacts_;
  Lazy<tandem_tolerance_query, tandem_tolerance_query_create, tandem_tolerance_query_destroy,
       tandem_tolerance_query_set_assets, tandem_tolerance_query_where>
      verdicts_;
};

}  // namespace

void add_queries(nb::module_& module) {
  const auto none = [] { return nb::arg().none(); };
  nb::class_<Query>(module, "Query")
      .def(nb::init<nb::list>())
      .def("contacts", &Query::contacts, nb::arg(), none(), nb::arg(), nb::arg(), nb::arg(), nb::arg(),
           nb::arg(), none(), nb::arg())
      .def("pairs", &Query::pairs, nb::arg(), nb::arg(), nb::arg(), nb::arg(), none(), nb::arg())
      .def("keep_fixed", &Query::keep_fixed)
      .def("manifolds", &Query::manifolds)
      .def("contained", &Query::contained)
      .def("distances", &Query::distances, nb::arg(), none(), none(), nb::arg(), nb::arg(), none(), none(),
           nb::arg())
      .def("impacts", &Query::impacts, nb::arg(), nb::arg(), nb::arg(), none(), nb::arg(), none(), nb::arg())
      .def("verdicts", &Query::verdicts, nb::arg(), nb::arg(), none(), none(), nb::arg());
}

}  // namespace tandem::python
