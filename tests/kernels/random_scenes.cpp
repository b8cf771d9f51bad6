#include "random_scenes.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <initializer_list>
#include <stdexcept>
#include <tuple>

#include "kernels/asked.h"
#include "solid_meshes.h"

namespace tandem::test {
namespace {

constexpr std::uint64_t kMostTriangles = 60'000;  // of a scene

struct Body {
  std::uint32_t mesh;
  Pose rotation;
  double place[3];  // of its centre
};

class Maker {
 public:
  Maker(std::span<const AssetView> meshes, std::uint64_t seed) : meshes_(meshes), random_(seed) {
    require(query_.set_assets(meshes), "assets");
    first_ = static_cast<std::uint32_t>(random_.below(meshes.size()));
    size_ = radius(first_);
    far_ = size_ * pick({0, 0, 0, 1e4, 1e7, 1e12});
    for (double& x : origin_) x = far_ * pick({-1, 0, 0.7, 1});
  }

  void heap() {
    const double spread = std::exp(random_.uniform(std::log(0.2), std::log(1.2)));
    const std::uint64_t count = 2 + random_.below(24);
    const double half = spread * size_ * std::cbrt(static_cast<double>(count));
    for (std::uint64_t i = 0; i < count; ++i) add(any_of_like_size(), any_rotation(random_), near(half));
  }

  /// Each is brought to another until they nearly touch, and then a little further.
  void touching() {
    const std::uint64_t count = 2 + random_.below(12);
    add(first_, any_rotation(random_), near(0));
    for (std::uint64_t i = 1; i < count; ++i) {
      const Body other = bodies_[random_.below(bodies_.size())];
      if (!add(any_of_like_size(), any_rotation(random_), near(0))) return;
      Body& body = bodies_.back();
      const double least = std::min(radius(body.mesh), radius(other.mesh));
      const Direction direction = any_direction();
      const double distance = touching_distance(other, body, direction) -
                              least * pick({0, 1e-15, 1e-12, 1e-9, 1e-6, 1e-3, 0.03, 0.1});
      stand(body, other, direction, distance);
    }
  }

  void coincident() {
    const std::uint64_t places = 1 + random_.below(4);
    for (std::uint64_t i = 0; i < places; ++i) {
      const std::uint32_t mesh = any_of_like_size();
      const Pose rotation = any_rotation(random_);
      const Place place = near(size_);
      const std::uint64_t copies = 2 + random_.below(2);
      for (std::uint64_t copy = 0; copy < copies; ++copy) {
        Place moved = place;
        moved.at[random_.below(3)] += radius(mesh) * pick({0, 0, 0, 1e-15, 1e-12, 1e-7});
        add(mesh, rotation, moved);
      }
    }
  }

  /// Boxes of the bodies share faces, edges and corners.
  void face_to_face() {
    const FileHeader& header = *meshes_[first_].header;
    const Pose rotation = pick({0, 0, 1}) == 0 ? kIdentityPose : any_rotation(random_);
    const std::uint64_t side = 2 + random_.below(2);
    for (std::uint64_t i = 0; i < side * side * side; ++i) {
      const std::uint64_t cell[3] = {i % side, i / side % side, i / side / side};
      double extent[3];
      for (int k = 0; k < 3; ++k) {
        extent[k] = (static_cast<double>(header.upper[k]) - static_cast<double>(header.lower[k])) *
                    static_cast<double>(cell[k]);
      }
      Place place = near(0);
      for (int k = 0; k < 3; ++k) {
        for (int j = 0; j < 3; ++j) place.at[k] += rotation.rotation[k][j] * extent[j];
      }
      add(first_, rotation, place);
    }
  }

  /// Smaller ones in the middle of larger ones, without regard to their sizes.
  void nested() {
    std::vector<std::uint32_t> smaller;
    for (std::uint32_t m = 0; m < meshes_.size(); ++m) {
      if (radius(m) <= size_) smaller.push_back(m);
    }
    add(first_, any_rotation(random_), near(0));
    const std::uint64_t count = 1 + random_.below(16);
    for (std::uint64_t i = 0; i < count; ++i)
      add(smaller[random_.below(smaller.size())], any_rotation(random_), near(0.5 * size_));
  }

  std::vector<std::vector<Instance>> steps() {
    std::vector<std::vector<Instance>> steps = {posed()};
    for (Body& body : bodies_) {
      if (random_.below(3) == 0) continue;
      for (double& x : body.place) x += random_.symmetric(1e-3 * radius(body.mesh));
      turn_a_little(body.rotation);
    }
    steps.push_back(posed());
    for (Body& body : bodies_) {
      if (random_.below(4) == 0) body.place[0] += 4 * size_;
    }
    steps.push_back(posed());
    return steps;
  }

 private:
  struct Place {
    double at[3];
  };
  using Direction = std::array<double, 3>;

  double pick(std::initializer_list<double> values) { return values.begin()[random_.below(values.size())]; }
  double radius(std::uint32_t mesh) const { return radius_of(meshes_[mesh]); }

  Place near(double half) {
    return {{origin_[0] + random_.symmetric(half), origin_[1] + random_.symmetric(half),
             origin_[2] + random_.symmetric(half)}};
  }

  Direction any_direction() {
    Direction d;
    double length = 0;
    for (double& x : d) length = std::hypot(length, x = random_.symmetric(1));
    for (double& x : d) x /= length;
    return d;
  }

  std::uint32_t any_of_like_size() {
    for (;;) {
      const auto mesh = static_cast<std::uint32_t>(random_.below(meshes_.size()));
      if (radius(mesh) <= 8 * size_ && size_ <= 8 * radius(mesh)) return mesh;
    }
  }

  /// Whether there is room for its triangles. The first two bodies always have it.
  bool add(std::uint32_t mesh, const Pose& rotation, const Place& place) {
    triangles_ += meshes_[mesh].level().triangle_count;
    if (triangles_ > kMostTriangles && bodies_.size() >= 2) return false;
    bodies_.push_back({mesh, rotation, {place.at[0], place.at[1], place.at[2]}});
    return true;
  }

  static void stand(Body& body, const Body& other, const Direction& direction, double distance) {
    for (std::size_t k = 0; k < 3; ++k) body.place[k] = other.place[k] + distance * direction[k];
  }

  double touching_distance(const Body& other, Body& body, const Direction& direction) {
    double touching = 0, apart = 1.01 * (radius(other.mesh) + radius(body.mesh));
    for (int i = 0; i < 50; ++i) {
      const double middle = 0.5 * (touching + apart);
      stand(body, other, direction, middle);
      const Instance both[] = {posed(other), posed(body)};
      require(query_.find(both, {.first_contact_only = true}), "contacts");
      (query_.rows().empty() ? apart : touching) = middle;
    }
    return touching;
  }

  void turn_a_little(Pose& rotation) {
    const double angle = random_.symmetric(1e-3), c = std::cos(angle), s = std::sin(angle);
    const auto i = random_.below(3), j = (i + 1) % 3;
    for (int k = 0; k < 3; ++k) {
      double &x = rotation.rotation[i][k], &y = rotation.rotation[j][k];
      const double before = x;
      x = c * x - s * y, y = s * before + c * y;
    }
  }

  Instance posed(const Body& body) const {
    return {body.mesh, centred_at(meshes_[body.mesh], body.rotation, body.place)};
  }
  std::vector<Instance> posed() const {
    std::vector<Instance> out;
    for (const Body& body : bodies_) out.push_back(posed(body));
    return out;
  }

  std::span<const AssetView> meshes_;
  RandomPoses random_;
  Asked<ContactQuery> query_;
  std::uint32_t first_;  // the mesh that sets the scale
  double size_, far_;
  double origin_[3];
  std::uint64_t triangles_ = 0;
  std::vector<Body> bodies_;
};

struct Kind {
  const char* name;
  void (Maker::*make)();
};
constexpr Kind kKinds[] = {{"heap", &Maker::heap},
                           {"touching", &Maker::touching},
                           {"coincident", &Maker::coincident},
                           {"face to face", &Maker::face_to_face},
                           {"nested", &Maker::nested}};

template <typename Element>
std::string difference(const char* name, const std::vector<Element>& x, const std::vector<Element>& y) {
  if (x.size() != y.size()) return std::to_string(x.size()) + " and " + std::to_string(y.size()) + " " + name;
  for (std::size_t i = 0; i < x.size(); ++i) {
    if (std::memcmp(&x[i], &y[i], sizeof(Element)) != 0) return std::string(name) + " " + std::to_string(i);
  }
  return {};
}

bool finite(const double (&x)[3]) {
  return std::isfinite(x[0]) && std::isfinite(x[1]) && std::isfinite(x[2]);
}

std::string defect_of(const Manifold& m, std::uint32_t first_point, std::uint32_t pair) {
  if (!finite(m.normal) || !finite(m.area_vector) || !finite(m.centre) || !std::isfinite(m.depth))
    return "is not finite";
  const double length = std::hypot(m.normal[0], m.normal[1], m.normal[2]);
  if ((m.flags & kAmbiguous) != 0) return length == 0 && m.point_count == 0 ? "" : "is ambiguous and pushes";
  if (std::fabs(length - 1) > 1e-12) return "has no unit normal";
  if (m.depth < 0) return "has a negative depth";
  if (m.point_count < 1 || m.point_count > kMostManifoldPoints) return "has no points or too many";
  if (m.first_point != first_point) return "does not begin where the one before ends";
  if (m.pair < pair) return "comes after one of a later pair";
  return {};
}

std::string defect_of(const ManifoldPoint& p, const Manifold& m, std::uint32_t manifold,
                      const std::vector<ManifoldPoint>& before) {
  if (!finite(p.position) || !finite(p.in_a) || !finite(p.in_b) || !std::isfinite(p.depth))
    return "is not finite";
  if (p.depth < 0 || p.depth > m.depth) return "is deeper than its manifold, or not deep";
  if (p.id == 0) return "has no name";
  if (p.manifold != manifold) return "names another manifold";
  if (p.previous != kNoIndex && (p.previous >= before.size() || before[p.previous].id != p.id))
    return "is another than before";
  return {};
}

double largest(const double (&x)[3]) {
  return std::max({std::fabs(x[0]), std::fabs(x[1]), std::fabs(x[2])});
}

/// The points on the surfaces are where the middle and the depth say: to rounding, and as rotations are
/// rigid.
std::string misplaced(const Instance& a, const Instance& b, const Manifold& m, const ManifoldPoint& p) {
  double on_a[3], on_b[3];
  apply(a.pose, p.in_a[0], p.in_a[1], p.in_a[2], on_a);
  apply(b.pose, p.in_b[0], p.in_b[1], p.in_b[2], on_b);
  const double in_files = largest(p.in_a) + largest(p.in_b);
  const double slack = 3 * kRigidTolerance * in_files + 0x1p-48 * (largest(p.position) + in_files);
  for (int k = 0; k < 3; ++k) {
    if (std::fabs(0.5 * (on_a[k] + on_b[k]) - p.position[k]) > slack) return "is not half-way";
    if (std::fabs(on_a[k] - on_b[k] - p.depth * m.normal[k]) > slack) return "is not that deep";
  }
  return {};
}

bool repeats(std::vector<std::uint64_t>& values) {
  std::sort(values.begin(), values.end());
  return std::adjacent_find(values.begin(), values.end()) != values.end();
}

}  // namespace

std::size_t points_found_again(const Detected& found) {
  return static_cast<std::size_t>(
      std::count_if(found.points.begin(), found.points.end(),
                    [](const ManifoldPoint& p) { return p.previous != kNoIndex; }));
}

void require(Status status, const char* step) {
  if (status != Status::kOk) throw std::runtime_error(std::string(step) + ": " + explain(status));
}

void sort(std::vector<Contact>& contacts) {
  const auto key = [](const Contact& c) {
    return std::tie(c.pair, c.triangle_a, c.triangle_b, c.face_a, c.face_b);
  };
  std::sort(contacts.begin(), contacts.end(),
            [&](const Contact& x, const Contact& y) { return key(x) < key(y); });
}

RandomScene random_scene(std::span<const AssetView> meshes, std::uint64_t seed) {
  const Kind& kind = kKinds[seed % std::size(kKinds)];
  Maker maker(meshes, seed);
  (maker.*kind.make)();
  return {kind.name, maker.steps()};
}

SampleAssets sample_meshes() {
  RandomPoses random(1);
  SampleAssets assets;
  for (const Mesh& mesh :
       {cube(0.3f, 2), tetrahedron(), sphere(0.4, 3), pipe(12, 0.2, 0.4, 0.4f), wedge(), sheet(1, 3),
        joined(cube(0.5f), moved(cube(0.2f), 0.1f, 0, 0)), soup(random, 40, 0.3), grid_soup(random, 40, 2)}) {
    assets.add(mesh);
  }
  assets.add(cube(0.5f, 3), {4.5e6, 5.2e5, 100.3});
  return assets;
}

CpuDetection::CpuDetection(std::span<const AssetView> meshes, std::uint32_t threads) {
  require(scene_.set_threads(threads), "threads");
  require(scene_.set_assets(meshes), "assets");
}

Detected CpuDetection::step(std::span<const Instance> instances) {
  require(scene_.place(instances), "bodies");
  require(query_.find(scene_), "contacts");
  require(manifolds_.find(scene_, query_), "manifolds");
  require(containment_.find(scene_, query_), "containment");
  const auto copy = [](auto list) { return std::vector(list.begin(), list.end()); };
  Detected out = {copy(query_.pairs()),      copy(query_.rows()),   copy(manifolds_.rows()),
                  copy(manifolds_.points()), manifolds_.counters(), copy(containment_.rows())};
  sort(out.contacts);
  return out;
}

std::string first_difference(const Detected& x, const Detected& y) {
  for (const std::string& found :
       {difference("pairs", x.pairs, y.pairs), difference("contacts", x.contacts, y.contacts),
        difference("manifolds", x.manifolds, y.manifolds), difference("points", x.points, y.points),
        difference("contained", x.contained, y.contained)}) {
    if (!found.empty()) return found;
  }
  return x.counters == y.counters ? std::string() : "counters";
}

std::string first_defect(std::span<const Instance> instances, const Detected& found, const Detected& before) {
  std::uint32_t next = 0, pair = 0;
  std::vector<std::uint64_t> ids, previous;
  for (std::uint32_t i = 0; i < found.manifolds.size(); ++i) {
    const Manifold& m = found.manifolds[i];
    if (m.pair != pair) ids.clear();
    const auto told = [&](const char* what, std::uint32_t at, const std::string& why) {
      return std::string(what) + " " + std::to_string(at) + " " + why;
    };
    if (const std::string why = defect_of(m, next, pair); !why.empty()) return told("manifold", i, why);
    if (next + m.point_count > found.points.size()) return told("manifold", i, "lacks points");
    double deepest = 0;
    for (std::uint32_t at = next; at < next + m.point_count; ++at) {
      const ManifoldPoint& p = found.points[at];
      const auto [a, b] = found.pairs[m.pair];
      std::string why = defect_of(p, m, i, before.points);
      if (why.empty()) why = misplaced(instances[a], instances[b], m, p);
      if (!why.empty()) return told("point", at, why);
      deepest = std::max(deepest, p.depth);
      ids.push_back(p.id);
      if (p.previous != kNoIndex) previous.push_back(p.previous);
    }
    if (deepest < 0.8 * m.depth) return told("manifold", i, "is deeper than its points");
    if (repeats(ids)) return told("manifold", i, "has a name twice");
    next += m.point_count, pair = m.pair;
  }
  if (next != found.points.size()) return "there are points of no manifold";
  return repeats(previous) ? "a point of before is found twice" : "";
}

}  // namespace tandem::test
