#include "tandem/kernels/scene.h"

#include <bit>
#include <utility>

#include "bodies.h"
#include "handles.h"
#include "rows.h"

using namespace tandem;
using namespace tandem::c;

namespace {

// A question, and whether it has an answer.
template <typename Query>
struct Asked {
  Query query;
  bool found = false;
};

// Says whether there are contacts of the bodies as they stand, of which manifolds and contained bodies are
// made.
enum class Standing { none, some, all };

}  // namespace

struct tandem_scene : Allocated {
  Allocator allocator;
  AssetReferences assets;
  const tandem_excluded_pairs* excluded = nullptr;
  uint64_t where = 0;
  Scene scene;
  bool pairs_found = false;
  Standing standing = Standing::none;
  Asked<MovedQuery> moved;
  Asked<ContactQuery> contacts;
  Asked<ManifoldQuery> manifolds;
  Asked<ContainmentQuery> contained;
  Asked<DistanceQuery> distances;
  Asked<ImpactQuery> impacts;
  Asked<ToleranceQuery> verdicts;
  Asked<BodiesAtQuery> bodies_at;
  Asked<ConfigurationQuery> configurations;
  Asked<ClosestQuery> closest;
  Asked<RayQuery> rays;

  ~tandem_scene() { keep(nullptr); }

  tandem_status fail(tandem_status status, uint64_t at) {
    where = at;
    return status;
  }
  tandem_status told(Status status) {
    return status == Status::kOk ? tandem_status{TANDEM_OK} : fail(to_c(status), scene.where());
  }
  void forget_contacts() {
    standing = Standing::none;
    contacts.found = manifolds.found = contained.found = false;
  }
  // Has a reference to these instead of those before.
  void keep(const tandem_excluded_pairs* pairs) {
    if (pairs != nullptr) pairs->references.fetch_add(1, std::memory_order_relaxed);
    tandem_excluded_pairs_destroy(const_cast<tandem_excluded_pairs*>(excluded));
    excluded = pairs;
  }
};

namespace {

// Runs the body of a function, see guarded(); `where` begins as 0.
template <typename Body>
tandem_status enter(tandem_scene* scene, const Body& body) noexcept {
  return guarded(scene, [&](tandem_scene& self) -> tandem_status {
    self.where = 0;
    return body(self);
  });
}

tandem_status place(tandem_scene& self, const tandem_instance* instances, size_t count,
                    const tandem_pair_filter* filter) {
  tandem_pair_filter read;
  if (!is_there(instances, count)) return TANDEM_NULL_ARGUMENT;
  const tandem_status status = read_filter(filter, count, read, self.where);
  if (status != TANDEM_OK) return status;
  const auto* motion = reinterpret_cast<const Motion*>(read.motion);
  const ExcludedPairs excluded = read.excluded != nullptr ? read.excluded->table.view() : ExcludedPairs();
  const Status placed = self.scene.place(rows<Instance>(instances, count),
                                         {motion, read.group, read.mask, read.world, excluded});
  if (placed == Status::kOk) self.keep(read.excluded);
  return self.told(placed);
}

// The options of the libraries. Those that are not looked at here are checked by the libraries.
tandem_status read_options(const tandem_contact_options& given, ContactOptions& options) {
  if (given.mode > TANDEM_BOXES || given.first_contact_only > 1 || given.self_pairs > 1 ||
      given.add_error_bounds > 1)
    return TANDEM_BAD_OPTION;
  options.mode = static_cast<QueryMode>(given.mode);
  options.first_contact_only = given.first_contact_only != 0;
  options.self_pairs = given.self_pairs != 0;
  options.within = given.within;
  options.add_error_bounds = given.add_error_bounds != 0;
  options.leave_out_rings = given.leave_out_rings;
  return TANDEM_OK;
}

tandem_status read_options(const tandem_moved_options& given, MovedOptions& options) {
  if (given.reserved != 0) return TANDEM_BAD_OPTION;
  if (!is_there(given.tolerance_of_pair, given.tolerance_count)) return TANDEM_NULL_ARGUMENT;
  options.tolerance = given.tolerance;
  options.tolerance_of_pair = {given.tolerance_of_pair, given.tolerance_count};
  return TANDEM_OK;
}

tandem_status read_options(const tandem_distance_options& given, DistanceOptions& options) {
  if (given.limit_reach > 1) return TANDEM_BAD_OPTION;
  if (!is_there(given.former, given.former_count)) return TANDEM_NULL_ARGUMENT;
  options.tolerance.absolute = given.absolute_tolerance;
  if (given.relative_tolerance != 0) options.tolerance.relative = given.relative_tolerance;
  if (given.limit_reach != 0) options.reach = given.reach;
  options.former = rows<FormerNearest>(given.former, given.former_count);
  return TANDEM_OK;
}

tandem_status read_options(const tandem_impact_options& given, ImpactOptions& options) {
  if (given.reserved != 0) return TANDEM_BAD_OPTION;
  if (!is_there(given.motion, given.motion_count)) return TANDEM_NULL_ARGUMENT;
  options.motion = rows<RigidMotion>(given.motion, given.motion_count);
  options.duration = given.duration;
  if (given.tolerance != 0) options.tolerance = given.tolerance;
  return TANDEM_OK;
}

tandem_status read_options(const tandem_tolerance_options& given, ToleranceOptions& options) {
  if (given.reserved != 0) return TANDEM_BAD_OPTION;
  options.tolerance = given.tolerance;
  return TANDEM_OK;
}

tandem_status read_options(const tandem_bodies_at_options& given, BodiesAtOptions& options) {
  if (given.reserved != 0) return TANDEM_BAD_OPTION;
  if (!is_there(given.points, given.point_count)) return TANDEM_NULL_ARGUMENT;
  options.points = triples(given.points, given.point_count);
  return TANDEM_OK;
}

tandem_status read_options(const tandem_closest_options& given, ClosestOptions& options) {
  if (given.limit_reach > 1 || given.sides > 1 || given.reserved != 0) return TANDEM_BAD_OPTION;
  if (!is_there(given.points, given.point_count) || !is_there(given.bodies, given.body_count))
    return TANDEM_NULL_ARGUMENT;
  options.bodies = {given.bodies, given.body_count};
  options.points = triples(given.points, given.point_count);
  options.tolerance.absolute = given.absolute_tolerance;
  if (given.relative_tolerance != 0) options.tolerance.relative = given.relative_tolerance;
  if (given.limit_reach != 0) options.reach = given.reach;
  options.sides = given.sides != 0;
  return TANDEM_OK;
}

tandem_status read_options(const tandem_ray_options& given, RayOptions& options) {
  if (given.limit_reach > 1 || given.reserved != 0) return TANDEM_BAD_OPTION;
  if (!is_there(given.origins, given.ray_count) || !is_there(given.directions, given.ray_count))
    return TANDEM_NULL_ARGUMENT;
  options.origins = triples(given.origins, given.ray_count);
  options.directions = triples(given.directions, given.ray_count);
  if (given.limit_reach != 0) options.reach = given.reach;
  options.hits = static_cast<RayHits>(given.hits);
  return TANDEM_OK;
}

tandem_status read_options(const tandem_configuration_options& given, ConfigurationOptions& options) {
  if (given.find > TANDEM_CONFIGURATION_NEAREST) return TANDEM_BAD_OPTION;
  if (!is_there(given.bodies, given.body_count) || !is_there(given.poses, given.pose_count))
    return TANDEM_NULL_ARGUMENT;
  options.bodies = {given.bodies, given.body_count};
  options.poses = rows<Pose>(given.poses, given.pose_count);
  options.within = given.within;
  options.find = static_cast<ConfigurationPairs>(given.find);
  options.tolerance.absolute = given.absolute_tolerance;
  if (given.relative_tolerance != 0) options.tolerance.relative = given.relative_tolerance;
  return TANDEM_OK;
}

// Asks about the pairs that the options name, or where they name none, about those that the scene finds.
template <typename Query, typename Given, typename Options>
tandem_status find(tandem_scene& self, Asked<Query>& asked, const Given* given, Options& options) {
  asked.found = false;
  Given read;
  tandem_status status = read_struct(given, read);
  if (status == TANDEM_OK) status = read_options(read, options);
  std::span<const ObjectPair> pairs;
  if constexpr (requires { read.pairs; }) {
    if (status == TANDEM_OK && !is_there(read.pairs, read.pair_count)) status = TANDEM_NULL_ARGUMENT;
    pairs = rows<ObjectPair>(read.pairs, read.pair_count);
  }
  if (status != TANDEM_OK) return status;
  Status done = Status::kOk;
  if constexpr (requires { asked.query.find(self.scene, pairs, options); }) {
    done = pairs.data() != nullptr ? asked.query.find(self.scene, pairs, options)
                                   : asked.query.find(self.scene, options);
  } else {
    done = asked.query.find(self.scene, options);
  }
  asked.found = done == Status::kOk;
  return self.told(done);
}

template <typename Query, typename Given>
tandem_status find(tandem_scene* scene, Asked<Query> tandem_scene::*question, const Given* given) {
  return enter(scene, [&](tandem_scene& self) {
    typename Query::Options options;
    return find(self, self.*question, given, options);
  });
}

tandem_status find_manifolds(tandem_scene& self, const tandem_manifold_options* given) {
  ManifoldOptions options;
  bool keep = false;
  const tandem_status status = read_manifold_options(given, options, &keep);
  if (status != TANDEM_OK) return status;
  if (self.standing == Standing::none || (keep && !self.moved.found)) return TANDEM_CONTACTS_MISSING;
  return self.told(keep
                       ? self.manifolds.query.find(self.scene, self.moved.query, self.contacts.query, options)
                       : self.manifolds.query.find(self.scene, self.contacts.query, options));
}

template <typename Query>
std::span<const ObjectPair> pairs_of(const Asked<Query>& asked) {
  return asked.found ? asked.query.pairs() : std::span<const ObjectPair>();
}

// The rows of a question, or what else `get` gives, as the caller reads them.
template <typename Row, typename Query, typename Get>
const Row* rows_of(const tandem_scene* scene, const Asked<Query> tandem_scene::*question, size_t* count,
                   const Get& get) {
  using Rows = decltype(get((scene->*question).query));
  const bool there = scene != nullptr && (scene->*question).found;
  return result<Row>(there ? get((scene->*question).query) : Rows(), count);
}

constexpr auto kRows = [](const auto& query) { return query.rows(); };

template <typename Counters, typename Query>
void copy_counters(const Asked<Query>& asked, Counters& counters) {
  if (asked.found) counters = std::bit_cast<Counters>(asked.query.counters());
}

template <typename Real>
tandem_status deform(tandem_scene* scene, uint32_t asset, const Real* positions, size_t vertex_count) {
  return enter(scene, [&](tandem_scene& self) -> tandem_status {
    if (!is_there(positions, vertex_count)) return TANDEM_NULL_ARGUMENT;
    const Status deformed = self.scene.deform(asset, std::span(positions, 3 * vertex_count));
    if (deformed == Status::kOk) self.standing = Standing::none;
    return self.told(deformed);
  });
}

}  // namespace

tandem_status tandem_scene_create(const tandem_allocator* allocator, tandem_scene** scene) {
  return create(allocator, scene, [](tandem_scene& made) -> tandem_status {
    return made.scene.state() != nullptr ? TANDEM_OK : TANDEM_OUT_OF_MEMORY;
  });
}

tandem_status tandem_scene_create_on(tandem_device* device, const tandem_allocator* allocator,
                                     tandem_scene** scene) {
  auto* taken = reinterpret_cast<SceneDevice*>(device);
  tandem_status status = taken != nullptr ? TANDEM_OK : TANDEM_NULL_ARGUMENT;
  if (status == TANDEM_OK) {
    status = create(allocator, scene, [&](tandem_scene& made) -> tandem_status {
      return to_c(made.scene.answer_on(std::exchange(taken, nullptr)));
    });
  } else if (scene != nullptr) {
    *scene = nullptr;
  }
  destroy(taken);
  return status;
}

void tandem_device_destroy(tandem_device* device) {
  destroy(reinterpret_cast<SceneDevice*>(device));
}

void tandem_scene_destroy(tandem_scene* scene) {
  delete scene;
}

tandem_status tandem_scene_set_threads(tandem_scene* scene, uint32_t threads) {
  return enter(scene, [&](tandem_scene& self) {
    return self.told(self.scene.set_threads(threads != 0 ? threads : 1));
  });
}

tandem_status tandem_scene_set_assets(tandem_scene* scene, tandem_asset* const* assets, size_t count) {
  return enter(scene, [&](tandem_scene& self) {
    self.forget_contacts();
    self.pairs_found = self.moved.found = self.distances.found = self.impacts.found = self.verdicts.found =
        self.bodies_at.found = self.configurations.found = self.closest.found = self.rays.found = false;
    // Points of before are not those of other assets.
    self.manifolds.query.forget_points();
    const tandem_status status = self.assets.replace(
        assets, count, self.where,
        [&](std::span<const AssetView> views) { return self.told(self.scene.set_assets(views)); });
    self.keep(nullptr);
    return status;
  });
}

tandem_status tandem_scene_deform(tandem_scene* scene, uint32_t asset, const float* positions,
                                  size_t vertex_count) {
  return deform(scene, asset, positions, vertex_count);
}

tandem_status tandem_scene_deform_f64(tandem_scene* scene, uint32_t asset, const double* positions,
                                      size_t vertex_count) {
  return deform(scene, asset, positions, vertex_count);
}

double tandem_scene_looseness(const tandem_scene* scene, uint32_t asset) {
  return scene != nullptr ? scene->scene.looseness(asset) : 1;
}

tandem_status tandem_scene_place(tandem_scene* scene, const tandem_instance* instances, size_t count,
                                 const tandem_pair_filter* filter) {
  return enter(scene, [&](tandem_scene& self) {
    self.standing = Standing::none;
    const tandem_status status = place(self, instances, count, filter);
    if (status != TANDEM_OK) {
      (void)self.scene.place({});
      self.keep(nullptr);
    }
    return status;
  });
}

tandem_status tandem_scene_place_alone(tandem_scene* scene, tandem_asset* asset) {
  const tandem_status status = tandem_scene_set_assets(scene, &asset, 1);
  if (status != TANDEM_OK) return status;
  const tandem_instance instance = {0, 0, {{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}, {0, 0, 0}}};
  return tandem_scene_place(scene, &instance, 1, nullptr);
}

tandem_status tandem_scene_add(tandem_scene* scene, const tandem_instance* instance,
                               const tandem_pair_filter* filter, uint32_t* body) {
  if (body != nullptr) *body = TANDEM_NO_INDEX;
  return enter(scene, [&](tandem_scene& self) -> tandem_status {
    if (instance == nullptr || body == nullptr) return TANDEM_NULL_ARGUMENT;
    tandem_pair_filter read;
    if (const tandem_status status = read_filter(filter, 1, read, self.where); status != TANDEM_OK)
      return status;
    if (read.excluded != nullptr) return TANDEM_BAD_OPTION;
    BodyFilter of_body;
    if (read.motion != nullptr) of_body.motion = static_cast<Motion>(*read.motion);
    if (read.group != nullptr) of_body.group = *read.group;
    if (read.mask != nullptr) of_body.mask = *read.mask;
    if (read.world != nullptr) of_body.world = *read.world;
    uint32_t number = 0;
    const Status added = self.scene.add(*rows<Instance>(instance, 1).data(), number, of_body);
    if (added != Status::kOk) return self.told(added);
    self.standing = Standing::none;
    *body = number;
    return TANDEM_OK;
  });
}

tandem_status tandem_scene_move(tandem_scene* scene, const uint32_t* bodies, const tandem_pose* poses,
                                size_t count) {
  return enter(scene, [&](tandem_scene& self) -> tandem_status {
    if (!is_there(bodies, count) || !is_there(poses, count)) return TANDEM_NULL_ARGUMENT;
    const Status moved = self.scene.move(std::span(bodies, count), rows<Pose>(poses, count));
    if (moved == Status::kOk) self.standing = Standing::none;
    return self.told(moved);
  });
}

tandem_status tandem_scene_set_motion(tandem_scene* scene, uint32_t body, uint32_t motion) {
  return enter(scene, [&](tandem_scene& self) {
    if (motion <= TANDEM_SLEEPING) return self.told(self.scene.set_motion(body, static_cast<Motion>(motion)));
    self.where = body;
    return tandem_status{TANDEM_BAD_MOTION};
  });
}

tandem_status tandem_scene_remove(tandem_scene* scene, uint32_t body) {
  return enter(scene, [&](tandem_scene& self) {
    const Status removed = self.scene.remove(body);
    if (removed == Status::kOk) self.standing = Standing::none;
    return self.told(removed);
  });
}

const tandem_instance* tandem_scene_instances(const tandem_scene* scene, size_t* count) {
  return result<tandem_instance>(scene != nullptr ? scene->scene.instances() : std::span<const Instance>(),
                                 count);
}

uint64_t tandem_scene_where(const tandem_scene* scene) {
  return scene != nullptr ? scene->where : 0;
}

const tandem_object_pair* tandem_scene_pairs(const tandem_scene* scene, uint32_t question, size_t* count) {
  std::span<const ObjectPair> pairs;
  if (scene != nullptr && question == TANDEM_PAIRS && scene->pairs_found) pairs = scene->scene.pairs();
  if (scene != nullptr && question == TANDEM_MOVED) pairs = pairs_of(scene->moved);
  if (scene != nullptr && question == TANDEM_CONTACTS) pairs = pairs_of(scene->contacts);
  if (scene != nullptr && question == TANDEM_DISTANCES) pairs = pairs_of(scene->distances);
  if (scene != nullptr && question == TANDEM_IMPACTS) pairs = pairs_of(scene->impacts);
  if (scene != nullptr && question == TANDEM_VERDICTS) pairs = pairs_of(scene->verdicts);
  return result<tandem_object_pair>(pairs, count);
}

tandem_status tandem_scene_find_pairs(tandem_scene* scene, const tandem_pair_options* options) {
  return enter(scene, [&](tandem_scene& self) -> tandem_status {
    self.pairs_found = false;
    tandem_pair_options read;
    if (const tandem_status status = read_struct(options, read); status != TANDEM_OK) return status;
    if (read.self_pairs > 1) return TANDEM_BAD_OPTION;
    const Status done = self.scene.find_pairs(read.reach, read.self_pairs != 0);
    self.pairs_found = done == Status::kOk;
    return self.told(done);
  });
}

tandem_status tandem_scene_find_contacts(tandem_scene* scene, const tandem_contact_options* options) {
  return enter(scene, [&](tandem_scene& self) {
    self.forget_contacts();
    ContactOptions read;
    const tandem_status status = find(self, self.contacts, options, read);
    const bool all = read.mode == QueryMode::exact && !read.first_contact_only && read.within == 0 &&
                     !read.add_error_bounds;
    if (status == TANDEM_OK) self.standing = all ? Standing::all : Standing::some;
    return status;
  });
}

tandem_status tandem_scene_find_manifolds(tandem_scene* scene, const tandem_manifold_options* options) {
  return enter(scene, [&](tandem_scene& self) {
    const tandem_status status = find_manifolds(self, options);
    self.manifolds.found = status == TANDEM_OK;
    if (status != TANDEM_OK) {
      self.manifolds.query.forget_points();
      self.moved.query.forget_poses();
    }
    return status;
  });
}

tandem_status tandem_scene_find_contained(tandem_scene* scene) {
  return enter(scene, [&](tandem_scene& self) -> tandem_status {
    self.contained.found = false;
    if (self.standing != Standing::all) return TANDEM_CONTACTS_MISSING;
    const Status done = self.contained.query.find(self.scene, self.contacts.query);
    self.contained.found = done == Status::kOk;
    return self.told(done);
  });
}

// The rows of a question, and for those whose options are all that there is to say, how it is asked.
#define TANDEM_SCENE_ROWS(question, row)                                         \
  const row* tandem_scene_##question(const tandem_scene* scene, size_t* count) { \
    return rows_of<row>(scene, &tandem_scene::question, count, kRows);           \
  }
#define TANDEM_SCENE_QUESTION(question, given, row)                                       \
  tandem_status tandem_scene_find_##question(tandem_scene* scene, const given* options) { \
    return find(scene, &tandem_scene::question, options);                                 \
  }                                                                                       \
  TANDEM_SCENE_ROWS(question, row)

TANDEM_SCENE_ROWS(contacts, tandem_contact)
TANDEM_SCENE_ROWS(manifolds, tandem_manifold)
TANDEM_SCENE_ROWS(contained, tandem_containment)
TANDEM_SCENE_QUESTION(moved, tandem_moved_options, tandem_object_pair)
TANDEM_SCENE_QUESTION(distances, tandem_distance_options, tandem_distance)
TANDEM_SCENE_QUESTION(impacts, tandem_impact_options, tandem_impact)
TANDEM_SCENE_QUESTION(verdicts, tandem_tolerance_options, tandem_verdict)
TANDEM_SCENE_QUESTION(bodies_at, tandem_bodies_at_options, tandem_body_at)
TANDEM_SCENE_QUESTION(configurations, tandem_configuration_options, tandem_configuration_pair)
TANDEM_SCENE_QUESTION(closest, tandem_closest_options, tandem_closest_point)
TANDEM_SCENE_QUESTION(rays, tandem_ray_options, tandem_ray_hit)

tandem_status tandem_scene_find(tandem_scene* scene, const tandem_questions* questions) {
  return enter(scene, [&](tandem_scene& self) -> tandem_status {
    if (questions == nullptr) return TANDEM_NULL_ARGUMENT;
    tandem_questions read;
    tandem_status status = read_struct(questions, read);
    if (status == TANDEM_OK && read.contained > 1) status = TANDEM_BAD_OPTION;
    const auto ask = [&](auto find, const auto* options) {
      if (status == TANDEM_OK && options != nullptr) status = find(&self, options);
    };
    ask(tandem_scene_find_pairs, read.pairs);
    ask(tandem_scene_find_contacts, read.contacts);
    ask(tandem_scene_find_manifolds, read.manifolds);
    if (status == TANDEM_OK && read.contained != 0) status = tandem_scene_find_contained(&self);
    ask(tandem_scene_find_distances, read.distances);
    ask(tandem_scene_find_impacts, read.impacts);
    ask(tandem_scene_find_verdicts, read.verdicts);
    ask(tandem_scene_find_bodies_at, read.bodies_at);
    ask(tandem_scene_find_configurations, read.configurations);
    ask(tandem_scene_find_closest, read.closest);
    ask(tandem_scene_find_rays, read.rays);
    return status;
  });
}

const tandem_manifold_point* tandem_scene_points(const tandem_scene* scene, size_t* count) {
  return rows_of<tandem_manifold_point>(scene, &tandem_scene::manifolds, count,
                                        [](const ManifoldQuery& query) { return query.points(); });
}

tandem_status tandem_scene_get_counters(const tandem_scene* scene, tandem_counters* counters) {
  if (scene == nullptr) return TANDEM_NULL_ARGUMENT;
  tandem_counters filled = {};
  copy_counters(scene->contacts, filled.contacts);
  copy_counters(scene->manifolds, filled.manifolds);
  copy_counters(scene->contained, filled.contained);
  copy_counters(scene->distances, filled.distances);
  copy_counters(scene->impacts, filled.impacts);
  copy_counters(scene->verdicts, filled.verdicts);
  copy_counters(scene->moved, filled.moved);
  copy_counters(scene->configurations, filled.configurations);
  copy_counters(scene->closest, filled.closest);
  copy_counters(scene->rays, filled.rays);
  return write_struct(filled, counters);
}

tandem_status tandem_pose_at(const tandem_pose* start, const tandem_motion* motion, double t,
                             tandem_pose* pose) {
  if (start == nullptr || motion == nullptr || pose == nullptr) return TANDEM_NULL_ARGUMENT;
  const Pose moved = pose_at(std::bit_cast<Pose>(*start), std::bit_cast<RigidMotion>(*motion), t);
  *pose = std::bit_cast<tandem_pose>(moved);
  return TANDEM_OK;
}
