#include "contract/door.h"
#include "tandem/kernels/bodies_at_query.h"
#include "tandem/kernels/closest_query.h"
#include "tandem/kernels/containment_query.h"
#include "tandem/kernels/distance_query.h"
#include "tandem/kernels/excluded_pairs.h"
#include "tandem/kernels/impact_query.h"
#include "tandem/kernels/manifold_query.h"
#include "tandem/kernels/ray_query.h"
#include "tandem/kernels/tolerance_query.h"
#include "tandem/runtime/map.h"

namespace tandem::test {
namespace {

QueryMode mode_of(const Json& options) {
  const std::string mode = options.value("mode", "exact");
  return mode == "fast" ? QueryMode::fast : mode == "boxes" ? QueryMode::boxes : QueryMode::exact;
}

class CppDoor final : public Door {
 public:
  explicit CppDoor(std::shared_ptr<Scene> scene) : scene_(std::move(scene)) {}

  Outcome set_assets(const std::vector<std::string>& files) override {
    std::vector<AssetView> views;
    for (const std::string& file : files) {
      if (assets_.emplace_back().open(file.c_str()) != Status::kOk) return {"CannotOpen " + file};
      views.push_back(assets_.back().view());
    }
    return told(scene_->set_assets(views));
  }
  Outcome set_threads(std::uint32_t threads) override { return told(scene_->set_threads(threads)); }

  Outcome place(const Bodies& bodies) override {
    if (const Status status = excluded_.set(bodies.excluded); status != Status::kOk) return told(status);
    std::vector<Motion> motion;
    for (const std::uint8_t one : bodies.motion) motion.push_back(static_cast<Motion>(one));
    PairFilter filter;
    if (!motion.empty()) filter.motion = motion.data();
    if (!bodies.group.empty()) filter.group = bodies.group.data();
    if (!bodies.mask.empty()) filter.mask = bodies.mask.data();
    if (!bodies.world.empty()) filter.world = bodies.world.data();
    filter.excluded = excluded_.view();
    return told(scene_->place(bodies.instances, filter));
  }
  Outcome add(const Bodies& body, std::uint32_t& number) override {
    BodyFilter filter;
    if (!body.motion.empty()) filter.motion = static_cast<Motion>(body.motion[0]);
    if (!body.group.empty()) filter.group = body.group[0];
    if (!body.mask.empty()) filter.mask = body.mask[0];
    if (!body.world.empty()) filter.world = body.world[0];
    return told(scene_->add(body.instances[0], number, filter));
  }
  Outcome move(const std::vector<std::uint32_t>& numbers, const Bodies& bodies) override {
    std::vector<Pose> poses;
    for (const Instance& instance : bodies.instances) poses.push_back(instance.pose);
    return told(scene_->move(numbers, poses));
  }
  Outcome set_motion(std::uint32_t body, std::uint32_t motion) override {
    return told(scene_->set_motion(body, static_cast<Motion>(motion)));
  }
  Outcome remove(std::uint32_t body) override { return told(scene_->remove(body)); }
  std::vector<std::uint32_t> assets_of_bodies() const override {
    std::vector<std::uint32_t> assets;
    for (const Instance& instance : scene_->instances()) assets.push_back(instance.asset);
    return assets;
  }

  Found ask(const std::string& question, const Json& options) override {
    if (question == "pairs") {
      Found found;
      static_cast<Outcome&>(found) =
          told(scene_->find_pairs(number(options, "reach", 0), flag(options, "self_pairs")));
      found.pairs.assign(scene_->pairs().begin(), scene_->pairs().end());
      found.rows.resize(found.pairs.size());
      return found;
    }
    if (question == "moved")
      return about_pairs(moved_, options, {.tolerance = number(options, "tolerance", 0)});
    if (question == "contacts") return contacts(options);
    if (question == "manifolds") return manifolds(options);
    if (question == "contained") return shown(contained_, contained_.find(*scene_, contacts_));
    if (question == "distances") return distances(options);
    if (question == "impacts") return impacts(options);
    if (question == "verdicts") return about_pairs(verdicts_, options, {number(options, "tolerance", 0)});
    if (question == "bodies_at")
      return shown(bodies_at_, bodies_at_.find(*scene_, {.points = points_of(options)}));
    if (question == "closest") return closest(options);
    if (question == "rays") return rays(options);
    return {{"no question " + question}, {}, {}, {}, {}};
  }

 private:
  Found closest(const Json& options) {
    const std::vector<std::array<double, 3>> points = points_of(options);
    const auto bodies = options.value("bodies", std::vector<std::uint32_t>{});
    ClosestOptions chosen = {.points = points, .bodies = bodies, .sides = flag(options, "sides")};
    chosen.reach = number(options, "reach", chosen.reach);
    return shown(closest_, closest_.find(*scene_, chosen));
  }

  Found rays(const Json& options) {
    const auto origins = points_of(options, "origins"), directions = points_of(options, "directions");
    RayOptions chosen = {.origins = origins, .directions = directions, .hits = RayHits{hits_of(options)}};
    chosen.reach = number(options, "reach", chosen.reach);
    return shown(rays_, rays_.find(*scene_, chosen));
  }

  Outcome told(Status status) const { return {name(status), status == Status::kOk ? 0 : scene_->where()}; }

  template <typename Query>
  Found shown(const Query& query, Status status) const {
    return {told(status),
            {query.pairs().begin(), query.pairs().end()},
            objects_of(query.rows()),
            {},
            object_of(query.counters())};
  }

  template <typename Query>
  Found about_pairs(Query& query, const Json& table, const typename Query::Options& options) {
    if (!table.contains("pairs")) return shown(query, query.find(*scene_, options));
    return shown(query, query.find(*scene_, pairs_of(table["pairs"]), options));
  }

  Found contacts(const Json& options) {
    return about_pairs(contacts_, options,
                       {.mode = mode_of(options),
                        .first_contact_only = flag(options, "first_contact_only"),
                        .self_pairs = flag(options, "self_pairs"),
                        .within = number(options, "within", 0),
                        .add_error_bounds = flag(options, "add_error_bounds"),
                        .leave_out_rings = options.value("leave_out_rings", 0u)});
  }

  Found manifolds(const Json& options) {
    ManifoldOptions chosen{.match_previous = flag(options, "match_previous", true),
                           .quick_depths = flag(options, "quick_depths", false)};
    if (options.contains("most_points")) chosen.most_points = options["most_points"];
    const Status status = flag(options, "keep") ? manifolds_.find(*scene_, moved_, contacts_, chosen)
                                                : manifolds_.find(*scene_, contacts_, chosen);
    Found found = shown(manifolds_, status);
    found.points = objects_of(manifolds_.points());
    return found;
  }

  Found distances(const Json& options) {
    DistanceOptions chosen;
    chosen.tolerance.absolute = number(options, "absolute_tolerance", 0);
    chosen.tolerance.relative = number(options, "relative_tolerance", chosen.tolerance.relative);
    chosen.reach = number(options, "reach", chosen.reach);
    std::vector<FormerNearest> former;
    for (std::size_t i = 0; options.contains("former") && i < distances_.rows().size(); ++i) {
      const ObjectDistance& row = distances_.rows()[i];
      former.push_back({distances_.pairs()[i].a, distances_.pairs()[i].b, row.triangle_a, row.triangle_b});
    }
    chosen.former = former;
    return about_pairs(distances_, options, chosen);
  }

  Found impacts(const Json& options) {
    const std::vector<RigidMotion> motion = motions_of(options["motion"], scene_->instances().size());
    return about_pairs(impacts_, options,
                       {.motion = motion,
                        .duration = number(options["duration"]),
                        .tolerance = number(options, "tolerance", ImpactOptions{}.tolerance)});
  }

  std::vector<MappedAsset> assets_;
  std::shared_ptr<Scene> scene_;
  ExcludedPairTable excluded_;
  MovedQuery moved_;
  ContactQuery contacts_;
  ManifoldQuery manifolds_;
  ContainmentQuery contained_;
  DistanceQuery distances_;
  ImpactQuery impacts_;
  ToleranceQuery verdicts_;
  BodiesAtQuery bodies_at_;
  ClosestQuery closest_;
  RayQuery rays_;
};

}  // namespace

std::unique_ptr<Door> cpp_door(std::shared_ptr<Scene> scene) {
  return std::make_unique<CppDoor>(std::move(scene));
}

}  // namespace tandem::test
