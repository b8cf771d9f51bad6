#include "touches.h"

#include <algorithm>
#include <cmath>

namespace tandem::python {
namespace {

struct Refused {
  tandem_status status;
  std::uint64_t where;
};

// The distance's points are right to a hundredth of the depth of the overlap, which is at most the reach;
// twice that is allowed for.
constexpr double kDepthError = 0.02;

std::vector<tandem_asset*> handles_of(nb::list assets) {
  std::vector<tandem_asset*> handles;
  for (nb::handle asset : assets) handles.push_back(nb::cast<const Asset&>(asset).get());
  return handles;
}

double dot(const double (&u)[3], const double (&v)[3]) {
  return u[0] * v[0] + u[1] * v[1] + u[2] * v[2];
}

void copy(const double (&from)[3], double (&to)[3]) {
  std::copy(from, from + 3, to);
}

// A solver that pushes by the depth needs the push to act through the middle of the overlap. Where a body is
// round, as a rod that lies on a floor is, the points of the rim are hardly deep, and the deepest point,
// which is to carry the load, may be anywhere along the rod: the body would rock from end to end. The
// manifold's centre moves gently with the bodies. So there the first point is moved to it, at its own depth;
// the more, the less deep the second deepest point is, and not at all where that is half as deep.
void move_to_centre(const tandem_manifold& manifold, std::span<const tandem_manifold_point> points,
                    Touch& touch) {
  const bool is_bent = !std::equal(touch.normal, touch.normal + 3, manifold.normal);
  if (!(manifold.depth > 0) || is_bent) return;  // between bent surfaces the centre is elsewhere
  double second = 0;
  for (const tandem_manifold_point& point : points.subspan(1)) second = std::max(second, point.depth);
  const double share = std::max(0.0, 1 - 2 * second / manifold.depth);
  double way[3];
  for (int i = 0; i < 3; ++i) way[i] = share * (manifold.centre[i] - touch.position[i]);
  const double along = dot(way, touch.normal);
  for (int i = 0; i < 3; ++i) touch.position[i] += way[i] - along * touch.normal[i];
}

}  // namespace

Touches::Scene::Scene(const std::vector<tandem_asset*>& assets, std::uint32_t threads) {
  tandem_scene* made = nullptr;
  check(tandem_scene_create(nullptr, &made));
  scene_.reset(made);
  check(tandem_scene_set_threads(made, threads));
  check(tandem_scene_set_assets(made, assets.data(), assets.size()));
}

void Touches::Scene::expect(tandem_status status) const {
  if (status != TANDEM_OK) throw Refused{status, tandem_scene_where(scene_.get())};
}

void Touches::Scene::place(std::span<const tandem_instance> bodies, const tandem_pair_filter* filter) {
  expect(tandem_scene_place(scene_.get(), bodies.data(), bodies.size(), filter));
}

template <typename Add>
void Touches::Scene::find_manifolds(const std::vector<tandem_object_pair>* asked, std::uint32_t most_points,
                                    const Add& add) {
  auto contacts = sized<tandem_contact_options>();
  if (asked != nullptr) contacts.pairs = asked->data(), contacts.pair_count = asked->size();
  expect(tandem_scene_find_contacts(scene_.get(), &contacts));
  auto manifolds = sized<tandem_manifold_options>();
  manifolds.most_points = most_points;
  manifolds.ignore_previous = 1;
  expect(tandem_scene_find_manifolds(scene_.get(), &manifolds));
  std::size_t count;
  const tandem_manifold_point* const points = tandem_scene_points(scene_.get(), &count);
  const tandem_manifold* const made = tandem_scene_manifolds(scene_.get(), &count);
  for (const tandem_manifold& manifold : std::span(made, count)) {
    const std::span of_manifold(points + manifold.first_point, manifold.point_count);
    const tandem_object_pair pair = pairs(TANDEM_CONTACTS)[manifold.pair];
    for (const tandem_manifold_point& point : of_manifold) {
      Touch touch{.a = pair.a, .b = pair.b, .gap = -point.depth};
      copy(point.normal, touch.normal);
      copy(point.position, touch.position);
      if (&point == &of_manifold.front()) move_to_centre(manifold, of_manifold, touch);
      add(manifold.pair, touch);
    }
  }
}

std::span<const tandem_distance> Touches::Scene::find_distances(const std::vector<tandem_object_pair>* asked,
                                                                double reach) {
  auto options = sized<tandem_distance_options>();
  options.limit_reach = 1;
  options.reach = reach;
  if (asked != nullptr) options.pairs = asked->data(), options.pair_count = asked->size();
  expect(tandem_scene_find_distances(scene_.get(), &options));
  std::size_t count;
  const tandem_distance* found = tandem_scene_distances(scene_.get(), &count);
  return {found, count};
}

std::span<const tandem_object_pair> Touches::Scene::pairs(std::uint32_t question) const {
  std::size_t count;
  const tandem_object_pair* found = tandem_scene_pairs(scene_.get(), question, &count);
  return {found, count};
}

Touches::Touches(nb::list assets, nb::handle asset, nb::handle pairs, nb::object filter,
                 std::uint32_t threads, std::uint32_t most_points)
    : pairs_are_given_(!pairs.is_none()),
      filter_(std::move(filter)),
      most_points_(most_points),
      scene_(handles_of(assets), threads),
      moved_scene_(handles_of(assets), threads) {
  for (const std::uint32_t place : copy_rows<std::uint32_t>(asset))
    bodies_.push_back({place, 0, {{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}, {0, 0, 0}}});
  if (pairs_are_given_) pairs_ = copy_rows<tandem_object_pair>(pairs);
}

void Touches::find(const Reach& reach, double largest) {
  const tandem_pair_filter* const filter =
      Filter::of(filter_.is_none() ? nullptr : nb::cast<const Filter*>(filter_));
  try {
    const WithoutLock other_threads_run;
    rows_.clear();
    scene_.place(bodies_, filter);
    scene_.find_manifolds(pairs_are_given_ ? &pairs_ : nullptr, most_points_,
                          [&](std::uint32_t, const Touch& touch) { rows_.push_back(touch); });
    if (largest > 0) find_near(reach, largest);
  } catch (const Refused& refused) {
    check(refused.status, refused.where);
  }
}

void Touches::find_near(const Reach& reach, double largest) {
  near_.clear();
  const auto found = scene_.find_distances(pairs_are_given_ ? &pairs_ : nullptr, largest);
  for (std::size_t row = 0; row < found.size(); ++row) {
    const tandem_distance& distance = found[row];
    if (!(distance.lower > 0) || distance.triangle_a == TANDEM_NO_INDEX) continue;
    Near near{.pair = scene_.pairs(TANDEM_DISTANCES)[row], .distance = &distance};
    for (int i = 0; i < 3; ++i) near.way[i] = distance.point_b[i] - distance.point_a[i];
    near.gap = std::sqrt(dot(near.way, near.way));
    near.reach = reach(near.pair.a, near.pair.b);
    if (!(near.gap > 0 && near.gap <= near.reach)) continue;
    for (double& coordinate : near.way) coordinate /= near.gap;
    near_.push_back(near);
  }
  if (!near_.empty()) add_near();
}

void Touches::add_near() {
  moved_.clear();  // each pair has two bodies of its own
  moved_pairs_.clear();
  for (const Near& near : near_) {
    const auto first = static_cast<std::uint32_t>(moved_.size());
    moved_pairs_.push_back({first, first + 1});
    moved_.push_back(bodies_[near.pair.a]);
    moved_.push_back(bodies_[near.pair.b]);
    for (int i = 0; i < 3; ++i) moved_.back().pose.translation[i] -= near.reach * near.way[i];
  }
  moved_scene_.place(moved_, nullptr);
  moved_scene_.find_manifolds(&moved_pairs_, most_points_, [&](std::uint32_t pair, Touch touch) {
    Near& near = near_[pair];
    const double gap = touch.gap + near.reach * dot(near.way, touch.normal);
    // No surfaces are nearer than `lower`: what seems so was met on the way, and not along it.
    if (gap < near.distance->lower - kDepthError * near.reach) return;
    near.has_manifold = true;
    touch.a = near.pair.a;
    touch.b = near.pair.b;
    touch.gap = std::max(gap, near.distance->lower);
    for (int i = 0; i < 3; ++i) touch.position[i] += 0.5 * near.reach * near.way[i];
    rows_.push_back(touch);
  });
  for (const Near& near : near_) {
    if (near.has_manifold) continue;
    Touch touch{.a = near.pair.a, .b = near.pair.b, .gap = near.gap};
    copy(near.way, touch.normal);
    for (int i = 0; i < 3; ++i)
      touch.position[i] = 0.5 * (near.distance->point_a[i] + near.distance->point_b[i]);
    rows_.push_back(touch);
  }
}

namespace {

// Touches of bodies whose reach is the sum of two margins.
class MarginTouches {
 public:
  MarginTouches(nb::list assets, nb::handle asset, nb::handle pairs, nb::object filter, nb::handle margin,
                std::uint32_t threads, std::uint32_t most_points)
      : touches_(assets, asset, pairs, filter, threads, most_points), margin_(copy_rows<double>(margin)) {}

  nb::object find(nb::handle instances) {
    const Turn turn(busy_, "another thread is in a call of these contacts");
    auto bodies = copy_rows<tandem_instance>(instances);
    if (bodies.size() != margin_.size()) throw_broken_rows();
    touches_.bodies() = std::move(bodies);
    const double widest = *std::max_element(margin_.begin(), margin_.end());
    touches_.find([this](std::uint32_t a, std::uint32_t b) { return margin_[a] + margin_[b]; }, 2 * widest);
    return to_python(touches_.rows().data(), touches_.rows().size());
  }

 private:
  Touches touches_;
  const std::vector<double> margin_;
  std::atomic<bool> busy_ = false;
};

}  // namespace

void add_touches(nb::module_& module) {
  nb::class_<MarginTouches>(module, "Touches")
      .def(nb::init<nb::list, nb::handle, nb::handle, nb::object, nb::handle, std::uint32_t, std::uint32_t>(),
           nb::arg(), nb::arg(), nb::arg().none(), nb::arg().none(), nb::arg(), nb::arg(), nb::arg())
      .def("find", &MarginTouches::find);
}

}  // namespace tandem::python
