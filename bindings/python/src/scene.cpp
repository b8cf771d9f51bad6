#include <algorithm>
#include <memory>

#include "core.h"

namespace tandem::python {
namespace {

// The object pairs that a question is told of, or none where the scene is to find them.
class GivenPairs {
 public:
  explicit GivenPairs(nb::handle pairs) : given_(!pairs.is_none()) {
    if (given_) rows_ = copy_rows<tandem_object_pair>(pairs);
  }
  template <typename Options>
  void put_into(Options& options) const {
    options.pairs = given_ ? rows_.data() : nullptr;
    options.pair_count = rows_.size();
  }

 private:
  bool given_;
  std::vector<tandem_object_pair> rows_;
};

class Scene {
 public:
  // device: a tandem_device as a number, or 0: the CPU answers.
  Scene(nb::list assets, std::uintptr_t device) {
    std::vector<tandem_asset*> list;
    for (nb::handle asset : assets) list.push_back(nb::cast<const Asset&>(asset).get());
    tandem_scene* made = nullptr;
    auto* const answers = reinterpret_cast<tandem_device*>(device);
    check(answers == nullptr ? tandem_scene_create(nullptr, &made)
                             : tandem_scene_create_on(answers, nullptr, &made));
    scene_.reset(made);
    ask([&](tandem_scene* scene) { return tandem_scene_set_assets(scene, list.data(), list.size()); });
  }

  void set_threads(std::uint32_t threads) {
    const Turn turn = take_turn();
    ask([&](tandem_scene* scene) { return tandem_scene_set_threads(scene, threads); });
  }

  // positions: contiguous, float32 or float64.
  void deform(std::uint32_t asset, nb::handle positions, bool in_float64) {
    const auto of = [&](auto function, const auto& numbers) {
      const Turn turn = take_turn();
      contacts_asked_ = false;
      const std::size_t count = numbers.size() / 3;
      const tandem_status status =
          status_of([&](tandem_scene* scene) { return function(scene, asset, numbers.data(), count); });
      const std::uint64_t where = tandem_scene_where(scene_.get());
      const bool is_of_positions = status == TANDEM_OUT_OF_RANGE || status == TANDEM_NOT_FLOAT32;
      if (is_of_positions && where < count) throw_vertex(status, asset, where);
      if (is_of_positions)
        throw_status(status, "a body reaches too far with these positions of its asset", "asset", asset);
      if (status != TANDEM_OK) check(status, where);
    };
    if (in_float64)
      of(tandem_scene_deform_f64, copy_rows<double>(positions));
    else
      of(tandem_scene_deform, copy_rows<float>(positions));
  }

  double looseness(std::uint32_t asset) const { return tandem_scene_looseness(scene_.get(), asset); }

  void place(nb::handle instances, const Filter* filter) {
    const auto rows = copy_rows<tandem_instance>(instances);
    change([&](tandem_scene* scene) {
      return tandem_scene_place(scene, rows.data(), rows.size(), Filter::of(filter));
    });
  }

  std::uint32_t add(nb::handle instance, const Filter* filter) {
    const auto rows = copy_rows<tandem_instance>(instance);
    if (rows.size() != 1) throw_broken_rows();
    std::uint32_t body = TANDEM_NO_INDEX;
    change(
        [&](tandem_scene* scene) { return tandem_scene_add(scene, rows.data(), Filter::of(filter), &body); });
    return body;
  }

  void move(nb::handle bodies, nb::handle instances) {
    const auto numbers = copy_rows<std::uint32_t>(bodies);
    const std::vector<tandem_pose> poses = poses_of(instances);
    if (poses.size() != numbers.size()) throw_broken_rows();
    change([&](tandem_scene* scene) {
      return tandem_scene_move(scene, numbers.data(), poses.data(), poses.size());
    });
  }

  void set_motion(std::uint32_t body, std::uint32_t motion) {
    const Turn turn = take_turn();
    ask([&](tandem_scene* scene) { return tandem_scene_set_motion(scene, body, motion); });
  }

  void remove(std::uint32_t body) {
    change([&](tandem_scene* scene) { return tandem_scene_remove(scene, body); });
  }

  nb::object instances() const { return rows<tandem_scene_instances>(); }

  std::size_t count() const {
    std::size_t bodies;
    tandem_scene_instances(scene_.get(), &bodies);
    return bodies;
  }

  nb::object pairs(double reach, bool self_pairs) {
    const Turn turn = take_turn();
    auto options = sized<tandem_pair_options>();
    options.reach = reach;
    options.self_pairs = self_pairs;
    ask([&](tandem_scene* scene) { return tandem_scene_find_pairs(scene, &options); });
    return pairs_of(TANDEM_PAIRS);
  }

  nb::tuple contacts(nb::handle pairs, std::uint32_t mode, bool first_contact_only, bool self_pairs,
                     double within, bool add_error_bounds, std::uint32_t leave_out_rings) {
    const Turn turn = take_turn();
    const GivenPairs given(pairs);
    auto options = sized<tandem_contact_options>();
    options.mode = mode;
    options.first_contact_only = first_contact_only;
    options.self_pairs = self_pairs;
    options.add_error_bounds = add_error_bounds;
    options.within = within;
    options.leave_out_rings = leave_out_rings;
    given.put_into(options);
    find_contacts(options);
    auto counters = sized<tandem_counters>();
    check(tandem_scene_get_counters(scene_.get(), &counters));
    return nb::make_tuple(pairs_of(TANDEM_CONTACTS), rows<tandem_scene_contacts>(),
                          counters_of(counters.contacts));
  }

  nb::tuple moved(double tolerance, nb::handle of_pair, nb::handle pairs) {
    const Turn turn = take_turn();
    const GivenPairs given(pairs);
    std::vector<double> tolerances;
    if (!of_pair.is_none()) tolerances = copy_rows<double>(of_pair);
    auto options = sized<tandem_moved_options>();
    options.tolerance = tolerance;
    options.tolerance_of_pair = tolerances.data();
    options.tolerance_count = tolerances.size();
    given.put_into(options);
    const nb::object found = answer<tandem_scene_find_moved, tandem_scene_moved>(options);
    return nb::make_tuple(pairs_of(TANDEM_MOVED), found);
  }

  nb::tuple manifolds(std::uint32_t most_points, bool match_previous, bool keep, bool quick_depths) {
    const Turn turn = take_turn();
    find_missing_contacts();
    auto options = sized<tandem_manifold_options>();
    options.most_points = most_points;
    options.ignore_previous = !match_previous;
    options.keep = keep;
    options.quick_depths = quick_depths;
    ask([&](tandem_scene* scene) { return tandem_scene_find_manifolds(scene, &options); });
    return nb::make_tuple(pairs_of(keep ? TANDEM_MOVED : TANDEM_CONTACTS), rows<tandem_scene_manifolds>(),
                          rows<tandem_scene_points>());
  }

  nb::tuple contained() {
    const Turn turn = take_turn();
    find_missing_contacts();
    ask(tandem_scene_find_contained);
    return nb::make_tuple(pairs_of(TANDEM_CONTACTS), rows<tandem_scene_contained>());
  }

  nb::tuple distances(nb::handle pairs, nb::handle reach, double absolute_tolerance,
                      double relative_tolerance, nb::handle former) {
    const Turn turn = take_turn();
    const GivenPairs given(pairs);
    std::vector<tandem_former_nearest> nearest;
    if (!former.is_none()) nearest = copy_rows<tandem_former_nearest>(former);
    auto options = sized<tandem_distance_options>();
    options.limit_reach = !reach.is_none();
    options.reach = reach.is_none() ? 0 : nb::cast<double>(reach);
    options.absolute_tolerance = absolute_tolerance;
    options.relative_tolerance = relative_tolerance;
    options.former = nearest.data();
    options.former_count = nearest.size();
    given.put_into(options);
    const nb::object found = answer<tandem_scene_find_distances, tandem_scene_distances>(options);
    return nb::make_tuple(pairs_of(TANDEM_DISTANCES), found);
  }

  nb::tuple impacts(nb::handle motion, double duration, nb::handle pairs, double tolerance) {
    const Turn turn = take_turn();
    const GivenPairs given(pairs);
    const auto motions = copy_rows<tandem_motion>(motion);
    auto options = sized<tandem_impact_options>();
    options.duration = duration;
    options.tolerance = tolerance;
    options.motion = motions.data();
    options.motion_count = motions.size();
    given.put_into(options);
    const nb::object found = answer<tandem_scene_find_impacts, tandem_scene_impacts>(options);
    return nb::make_tuple(pairs_of(TANDEM_IMPACTS), found);
  }

  nb::tuple verdicts(double tolerance, nb::handle pairs) {
    const Turn turn = take_turn();
    const GivenPairs given(pairs);
    auto options = sized<tandem_tolerance_options>();
    options.tolerance = tolerance;
    given.put_into(options);
    const nb::object found = answer<tandem_scene_find_verdicts, tandem_scene_verdicts>(options);
    return nb::make_tuple(pairs_of(TANDEM_VERDICTS), found);
  }

  nb::object bodies_at(nb::handle points) {
    const Turn turn = take_turn();
    const auto coordinates = copy_rows<double>(points);
    auto options = sized<tandem_bodies_at_options>();
    options.points = coordinates.data();
    options.point_count = coordinates.size() / 3;
    return answer<tandem_scene_find_bodies_at, tandem_scene_bodies_at>(options);
  }

  nb::object configurations(nb::handle bodies, nb::handle poses, double within, std::uint32_t find,
                            double absolute_tolerance, double relative_tolerance) {
    const Turn turn = take_turn();
    const auto moving = copy_rows<std::uint32_t>(bodies);
    copy_rows(poses, configurations_);
    auto options = sized<tandem_configuration_options>();
    options.bodies = moving.data();
    options.body_count = moving.size();
    options.poses = configurations_.data();
    options.pose_count = configurations_.size();
    options.within = within;
    options.find = find;
    options.absolute_tolerance = absolute_tolerance;
    options.relative_tolerance = relative_tolerance;
    return answer<tandem_scene_find_configurations, tandem_scene_configurations>(options);
  }

  nb::object closest(nb::handle points, nb::handle bodies, nb::handle reach, double absolute_tolerance,
                     double relative_tolerance, bool sides) {
    const Turn turn = take_turn();
    const auto coordinates = copy_rows<double>(points);
    const auto asked = copy_rows<std::uint32_t>(bodies);
    auto options = sized<tandem_closest_options>();
    options.points = coordinates.data();
    options.point_count = coordinates.size() / 3;
    options.limit_reach = !reach.is_none();
    if (!reach.is_none()) options.reach = nb::cast<double>(reach);
    options.absolute_tolerance = absolute_tolerance;
    options.relative_tolerance = relative_tolerance;
    options.sides = sides;
    options.bodies = asked.data();
    options.body_count = asked.size();
    return answer<tandem_scene_find_closest, tandem_scene_closest>(options);
  }

  nb::object rays(nb::handle origins, nb::handle directions, nb::handle reach, std::uint32_t hits) {
    const Turn turn = take_turn();
    const auto from = copy_rows<double>(origins), along = copy_rows<double>(directions);
    auto options = sized<tandem_ray_options>();
    options.origins = from.data();
    options.directions = along.data();
    options.ray_count = std::min(from.size(), along.size()) / 3;
    options.limit_reach = !reach.is_none();
    if (!reach.is_none()) options.reach = nb::cast<double>(reach);
    options.hits = hits;
    return answer<tandem_scene_find_rays, tandem_scene_rays>(options);
  }

 private:
  static std::vector<tandem_pose> poses_of(nb::handle instances) {
    std::vector<tandem_pose> poses;
    for (const tandem_instance& instance : copy_rows<tandem_instance>(instances))
      poses.push_back(instance.pose);
    return poses;
  }

  // The scene takes one call at a time, whichever threads make them.
  Turn take_turn() { return Turn(busy_, "another thread is in a call of this scene"); }

  // Makes a call of the C interface without the interpreter's lock.
  template <typename Call>
  tandem_status status_of(const Call& call) {
    const WithoutLock other_threads_run;
    return call(scene_.get());
  }

  template <typename Call>
  void ask(const Call& call) {
    if (const tandem_status status = status_of(call); status != TANDEM_OK)
      check(status, tandem_scene_where(scene_.get()));
  }

  // Asks a question; its rows.
  template <auto find, auto get, typename Options>
  nb::object answer(const Options& options) {
    ask([&](tandem_scene* scene) { return find(scene, &options); });
    return rows<get>();
  }

  // Makes a call after which bodies are elsewhere or others.
  template <typename Call>
  void change(const Call& call) {
    const Turn turn = take_turn();
    contacts_asked_ = false;
    ask(call);
  }

  void find_contacts(const tandem_contact_options& options) {
    contacts_asked_ = true;
    ask([&](tandem_scene* scene) { return tandem_scene_find_contacts(scene, &options); });
  }

  void find_missing_contacts() {
    if (!contacts_asked_) find_contacts(sized<tandem_contact_options>());
  }

  // A copy of rows that the scene has, as a bytearray: NumPy makes an array of it that owns it.
  template <auto get, typename... Which>
  nb::object rows(Which... which) const {
    std::size_t count;
    const auto* first = get(scene_.get(), which..., &count);
    return make_bytes(first, count * sizeof *first);
  }
  nb::object pairs_of(std::uint32_t question) const { return rows<tandem_scene_pairs>(question); }

  std::unique_ptr<tandem_scene, decltype(&tandem_scene_destroy)> scene_{nullptr, tandem_scene_destroy};
  std::atomic<bool> busy_ = false;
  std::vector<tandem_pose> configurations_;  // the memory is kept, since new pages cost as much as the copy
  bool contacts_asked_ = false;              // since bodies were last changed
};

}  // namespace

void add_scenes(nb::module_& module) {
  const auto none = [] { return nb::arg().none(); };
  nb::class_<Scene>(module, "Scene")
      .def(nb::init<nb::list, std::uintptr_t>())
      .def("set_threads", &Scene::set_threads)
      .def("deform", &Scene::deform)
      .def("looseness", &Scene::looseness)
      .def("place", &Scene::place, nb::arg(), none())
      .def("add", &Scene::add, nb::arg(), none())
      .def("move", &Scene::move)
      .def("set_motion", &Scene::set_motion)
      .def("remove", &Scene::remove)
      .def("instances", &Scene::instances)
      .def("count", &Scene::count)
      .def("pairs", &Scene::pairs)
      .def("contacts", &Scene::contacts, none(), nb::arg(), nb::arg(), nb::arg(), nb::arg(), nb::arg(),
           nb::arg())
      .def("moved", &Scene::moved, nb::arg(), none(), none())
      .def("manifolds", &Scene::manifolds)
      .def("contained", &Scene::contained)
      .def("distances", &Scene::distances, none(), none(), nb::arg(), nb::arg(), none())
      .def("impacts", &Scene::impacts, nb::arg(), nb::arg(), none(), nb::arg())
      .def("verdicts", &Scene::verdicts, nb::arg(), none())
      .def("bodies_at", &Scene::bodies_at)
      .def("configurations", &Scene::configurations)
      .def("closest", &Scene::closest, nb::arg(), nb::arg(), none(), nb::arg(), nb::arg(), nb::arg())
      .def("rays", &Scene::rays, nb::arg(), nb::arg(), none(), nb::arg());
}

}  // namespace tandem::python
