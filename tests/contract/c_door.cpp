#include <gtest/gtest.h>

#include <atomic>
#include <cmath>
#include <cstring>
#include <new>
#include <span>

#include "contract/door.h"

namespace tandem::test {
namespace {

static_assert(sizeof(tandem_object_pair) == sizeof(ObjectPair) &&
              sizeof(tandem_motion) == sizeof(RigidMotion));

/// The bytes that an allocator has handed out and not got back.
struct Counted {
  std::atomic<std::int64_t> bytes = 0, blocks = 0;
};

void* take(void* user, std::size_t bytes, std::size_t alignment) {
  auto* const counted = static_cast<Counted*>(user);
  counted->bytes += static_cast<std::int64_t>(bytes);
  ++counted->blocks;
  return ::operator new (bytes, std::align_val_t{alignment}, std::nothrow);
}

void give_back(void* user, void* memory, std::size_t bytes, std::size_t alignment) {
  auto* const counted = static_cast<Counted*>(user);
  counted->bytes -= static_cast<std::int64_t>(bytes);
  --counted->blocks;
  ::operator delete (memory, std::align_val_t{alignment});
}

tandem_pose pose_of(const Pose& from) {
  tandem_pose pose;
  static_assert(sizeof pose == sizeof from);
  std::memcpy(&pose, &from, sizeof pose);
  return pose;
}

template <typename Options>
Options sized() {
  Options options = {};
  options.struct_size = sizeof options;
  return options;
}

template <typename Row>
std::span<const Row> rows_of(const Row* (*get)(const tandem_scene*, std::size_t*),
                             const tandem_scene* scene) {
  std::size_t count = 77;
  const Row* const rows = get(scene, &count);
  EXPECT_EQ(rows == nullptr, count == 0);
  return {rows, count};
}

class CDoor final : public Door {
 public:
  explicit CDoor(SceneMaker* create) { EXPECT_EQ(create(&allocator_, &scene_), TANDEM_OK); }
  ~CDoor() override {
    tandem_scene_destroy(scene_);
    EXPECT_EQ(counted_.bytes, 0);
    EXPECT_EQ(counted_.blocks, 0);
  }

  Outcome set_assets(const std::vector<std::string>& files) override {
    std::vector<tandem_asset*> assets;
    for (const std::string& file : files) {
      const tandem_status status =
          tandem_asset_open(file.c_str(), nullptr, &allocator_, &assets.emplace_back(nullptr), nullptr);
      if (status != TANDEM_OK) return {tandem_status_name(status) + (" " + file)};
    }
    const Outcome outcome = told(tandem_scene_set_assets(scene_, assets.data(), assets.size()));
    for (tandem_asset* asset : assets) tandem_asset_release(asset);  // the scene has its own references
    return outcome;
  }
  Outcome set_threads(std::uint32_t threads) override {
    return told(tandem_scene_set_threads(scene_, threads));
  }

  Outcome place(const Bodies& bodies) override {
    std::vector<tandem_instance> instances;
    for (const Instance& body : bodies.instances) instances.push_back({body.asset, 0, pose_of(body.pose)});
    return filtered(bodies, [&](const tandem_pair_filter* filter) {
      return tandem_scene_place(scene_, instances.data(), instances.size(), filter);
    });
  }
  Outcome add(const Bodies& body, std::uint32_t& number) override {
    const tandem_instance instance = {body.instances[0].asset, 0, pose_of(body.instances[0].pose)};
    const Outcome outcome = filtered(body, [&](const tandem_pair_filter* filter) {
      return tandem_scene_add(scene_, &instance, filter, &number);
    });
    EXPECT_EQ(number == TANDEM_NO_INDEX, outcome.status != "Ok");
    return outcome;
  }
  Outcome move(const std::vector<std::uint32_t>& numbers, const Bodies& bodies) override {
    std::vector<tandem_pose> poses;
    for (const Instance& instance : bodies.instances) poses.push_back(pose_of(instance.pose));
    return told(tandem_scene_move(scene_, numbers.data(), poses.data(), numbers.size()));
  }
  Outcome set_motion(std::uint32_t body, std::uint32_t motion) override {
    return told(tandem_scene_set_motion(scene_, body, motion));
  }
  Outcome remove(std::uint32_t body) override { return told(tandem_scene_remove(scene_, body)); }
  std::vector<std::uint32_t> assets_of_bodies() const override {
    std::vector<std::uint32_t> assets;
    for (const tandem_instance& body : rows_of(tandem_scene_instances, scene_)) assets.push_back(body.asset);
    return assets;
  }

  Found ask(const std::string& question, const Json& options) override {
    std::vector<ObjectPair> given;
    if (options.contains("pairs")) given = pairs_of(options["pairs"]);
    given.push_back({});  // so that an empty list is not null
    const auto about = [&](auto& chosen) {
      if (!options.contains("pairs")) return;
      chosen.pairs = reinterpret_cast<const tandem_object_pair*>(given.data());
      chosen.pair_count = given.size() - 1;
    };
    if (question == "pairs") {
      auto chosen = sized<tandem_pair_options>();
      chosen.reach = number(options, "reach", 0);
      chosen.self_pairs = flag(options, "self_pairs");
      Found found = shown(tandem_scene_find_pairs(scene_, &chosen), TANDEM_PAIRS);
      found.rows.resize(found.pairs.size());
      return found;
    }
    if (question == "moved") {
      auto chosen = sized<tandem_moved_options>();
      chosen.tolerance = number(options, "tolerance", 0);
      about(chosen);
      return answered(tandem_scene_find_moved(scene_, &chosen), TANDEM_MOVED, tandem_scene_moved,
                      &tandem_counters::moved);
    }
    if (question == "contacts") {
      auto chosen = sized<tandem_contact_options>();
      const std::string mode = options.value("mode", "exact");
      chosen.mode = mode == "fast" ? TANDEM_FAST : mode == "boxes" ? TANDEM_BOXES : TANDEM_EXACT;
      chosen.first_contact_only = flag(options, "first_contact_only");
      chosen.self_pairs = flag(options, "self_pairs");
      chosen.add_error_bounds = flag(options, "add_error_bounds");
      chosen.within = number(options, "within", 0);
      chosen.leave_out_rings = options.value("leave_out_rings", 0u);
      about(chosen);
      return answered(tandem_scene_find_contacts(scene_, &chosen), TANDEM_CONTACTS, tandem_scene_contacts,
                      &tandem_counters::contacts);
    }
    if (question == "manifolds") {
      auto chosen = sized<tandem_manifold_options>();
      chosen.most_points = options.value("most_points", 0u);
      chosen.ignore_previous = !flag(options, "match_previous", true);
      chosen.quick_depths = flag(options, "quick_depths", false);
      chosen.keep = flag(options, "keep");
      Found found = answered(tandem_scene_find_manifolds(scene_, &chosen),
                             chosen.keep != 0 ? TANDEM_MOVED : TANDEM_CONTACTS, tandem_scene_manifolds,
                             &tandem_counters::manifolds);
      found.points = objects_of(rows_of(tandem_scene_points, scene_));
      return found;
    }
    if (question == "contained") {
      return answered(tandem_scene_find_contained(scene_), TANDEM_CONTACTS, tandem_scene_contained,
                      &tandem_counters::contained);
    }
    if (question == "distances") {
      auto chosen = sized<tandem_distance_options>();
      const std::vector<tandem_former_nearest> former = former_of(options);
      chosen.limit_reach = options.contains("reach");
      chosen.reach = number(options, "reach", 0);
      chosen.absolute_tolerance = number(options, "absolute_tolerance", 0);
      chosen.relative_tolerance = number(options, "relative_tolerance", 0);
      chosen.former = former.data();
      chosen.former_count = former.size();
      about(chosen);
      return answered(tandem_scene_find_distances(scene_, &chosen), TANDEM_DISTANCES, tandem_scene_distances,
                      &tandem_counters::distances);
    }
    if (question == "impacts") {
      auto chosen = sized<tandem_impact_options>();
      const auto motion = motions_of(options["motion"], rows_of(tandem_scene_instances, scene_).size());
      chosen.duration = number(options["duration"]);
      chosen.tolerance = number(options, "tolerance", 0);
      chosen.motion = reinterpret_cast<const tandem_motion*>(motion.data());
      chosen.motion_count = motion.size();
      about(chosen);
      return answered(tandem_scene_find_impacts(scene_, &chosen), TANDEM_IMPACTS, tandem_scene_impacts,
                      &tandem_counters::impacts);
    }
    if (question == "verdicts") {
      auto chosen = sized<tandem_tolerance_options>();
      chosen.tolerance = number(options, "tolerance", 0);
      about(chosen);
      return answered(tandem_scene_find_verdicts(scene_, &chosen), TANDEM_VERDICTS, tandem_scene_verdicts,
                      &tandem_counters::verdicts);
    }
    if (question == "bodies_at") {
      auto chosen = sized<tandem_bodies_at_options>();
      const std::vector<std::array<double, 3>> points = points_of(options);
      chosen.points = points.empty() ? nullptr : points[0].data();
      chosen.point_count = points.size();
      const Outcome outcome = told(tandem_scene_find_bodies_at(scene_, &chosen));
      return {outcome, {}, objects_of(rows_of(tandem_scene_bodies_at, scene_)), {}, {}};
    }
    if (question == "closest") return closest(options);
    if (question == "rays") return rays(options);
    return {{"no question " + question}, {}, {}, {}, {}};
  }

 private:
  Found closest(const Json& options) {
    auto chosen = sized<tandem_closest_options>();
    const std::vector<std::array<double, 3>> points = points_of(options);
    chosen.points = points.empty() ? nullptr : points[0].data();
    chosen.point_count = points.size();
    const std::vector<std::uint32_t> bodies = options.value("bodies", std::vector<std::uint32_t>{});
    chosen.bodies = bodies.data();
    chosen.body_count = bodies.size();
    chosen.sides = flag(options, "sides");
    chosen.limit_reach = options.contains("reach");
    chosen.reach = number(options, "reach", 0);
    const Outcome outcome = told(tandem_scene_find_closest(scene_, &chosen));
    return {outcome, {}, objects_of(rows_of(tandem_scene_closest, scene_)), {}, {}};
  }

  Found rays(const Json& options) {
    auto chosen = sized<tandem_ray_options>();
    const auto origins = points_of(options, "origins"), directions = points_of(options, "directions");
    chosen.origins = origins.empty() ? nullptr : origins[0].data();
    chosen.directions = directions.empty() ? nullptr : directions[0].data();
    chosen.ray_count = origins.size();
    chosen.hits = hits_of(options);
    chosen.limit_reach = options.contains("reach");
    chosen.reach = number(options, "reach", 0);
    const Outcome outcome = told(tandem_scene_find_rays(scene_, &chosen));
    return {outcome, {}, objects_of(rows_of(tandem_scene_rays, scene_)), {}, {}};
  }

  Outcome told(tandem_status status) const {
    return {tandem_status_name(status), tandem_scene_where(scene_)};
  }

  Found shown(tandem_status status, std::uint32_t question) const {
    std::size_t count = 0;
    const auto* pairs = reinterpret_cast<const ObjectPair*>(tandem_scene_pairs(scene_, question, &count));
    return {told(status), {pairs, pairs + count}, {}, {}, {}};
  }

  /// Reads the rows and the counters of a question that has been asked.
  template <typename Row, typename Counters>
  Found answered(tandem_status status, std::uint32_t question,
                 const Row* (*get)(const tandem_scene*, std::size_t*), Counters tandem_counters::*of) const {
    Found found = shown(status, question);
    found.rows = objects_of(rows_of(get, scene_));
    auto counters = sized<tandem_counters>();
    EXPECT_EQ(tandem_scene_get_counters(scene_, &counters), TANDEM_OK);
    found.counters = object_of(counters.*of);
    return found;
  }

  template <typename Call>
  Outcome filtered(const Bodies& bodies, const Call& call) {
    auto filter = sized<tandem_pair_filter>();
    tandem_excluded_pairs* excluded = nullptr;
    if (!bodies.excluded.empty()) {
      EXPECT_EQ(
          tandem_excluded_pairs_create(reinterpret_cast<const tandem_object_pair*>(bodies.excluded.data()),
                                       bodies.excluded.size(), &allocator_, &excluded),
          TANDEM_OK);
    }
    filter.motion = bodies.motion.empty() ? nullptr : bodies.motion.data();
    filter.group = bodies.group.empty() ? nullptr : bodies.group.data();
    filter.mask = bodies.mask.empty() ? nullptr : bodies.mask.data();
    filter.world = bodies.world.empty() ? nullptr : bodies.world.data();
    filter.excluded = excluded;
    for (const std::size_t count :
         {bodies.motion.size(), bodies.group.size(), bodies.mask.size(), bodies.world.size()})
      filter.count = count > 0 ? count : filter.count;
    const bool none = filter.count == 0 && excluded == nullptr;
    const Outcome outcome = told(call(none ? nullptr : &filter));
    tandem_excluded_pairs_destroy(excluded);  // the scene has them
    return outcome;
  }

  std::vector<tandem_former_nearest> former_of(const Json& options) const {
    std::vector<tandem_former_nearest> former;
    const auto rows = rows_of(tandem_scene_distances, scene_);
    const tandem_object_pair* pairs = tandem_scene_pairs(scene_, TANDEM_DISTANCES, nullptr);
    for (std::size_t i = 0; options.contains("former") && i < rows.size(); ++i)
      former.push_back({pairs[i].a, pairs[i].b, rows[i].triangle_a, rows[i].triangle_b});
    return former;
  }

  Counted counted_;
  tandem_allocator allocator_ = {sizeof(tandem_allocator), 0, &counted_, take, give_back};
  tandem_scene* scene_ = nullptr;
};

}  // namespace

std::unique_ptr<Door> c_door(SceneMaker* create) {
  return std::make_unique<CDoor>(create);
}

}  // namespace tandem::test
