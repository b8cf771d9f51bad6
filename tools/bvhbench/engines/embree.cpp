#include <embree3/rtcore.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <stdexcept>

#include "kernels/geometry/triangle_test.h"
#include "library_engine.h"

namespace tandem {
namespace {

float rounded_down(double x) {
  const float f = static_cast<float>(x);
  return f <= x ? f : std::nextafter(f, -std::numeric_limits<float>::infinity());
}

float rounded_up(double x) {
  const float f = static_cast<float>(x);
  return f >= x ? f : std::nextafter(f, std::numeric_limits<float>::infinity());
}

/// Signs as float64 computes them, right or wrong.
struct Float64Signs {
  static int sign(double x) { return (x > 0) - (x < 0); }

  /// det(q - p, r - p, s - p)
  static int volume(const double* p, const double* q, const double* r, const double* s) {
    double a[3], b[3], c[3];
    for (int k = 0; k < 3; ++k) a[k] = q[k] - p[k], b[k] = r[k] - p[k], c[k] = s[k] - p[k];
    return sign(c[0] * (a[1] * b[2] - a[2] * b[1]) + c[1] * (a[2] * b[0] - a[0] * b[2]) +
                c[2] * (a[0] * b[1] - a[1] * b[0]));
  }

  /// Component k of (q - p) x (r - p).
  static int area(const double* p, const double* q, const double* r, int k) {
    const int i = (k + 1) % 3, j = (k + 2) % 3;
    return sign((q[i] - p[i]) * (r[j] - p[j]) - (q[j] - p[j]) * (r[i] - p[i]));
  }
};

/// Returns whether two posed triangles meet by plain float64: Guigue and Devillers' test with all its ties,
/// signs taken as they come out. What a careful user of a library that finds candidates only would write.
bool meet_in_float64(const PosedTriangle& a, const PosedTriangle& b) {
  return detail::CompleteTest<Float64Signs>::meet(a.corner, b.corner);
}

/// The data of one body's scene. Embree holds its address.
struct EmbreeBody {
  const IndexedMesh* mesh = nullptr;
  std::vector<std::array<double, 3>> vertices;  ///< posed
  RTCGeometry geometry = nullptr;
  RTCScene scene = nullptr;

  void place(const Pose& pose) {
    vertices.resize(mesh->vertex_count());
    for (std::size_t i = 0; i < vertices.size(); ++i) {
      const float* v = &mesh->vertices[3 * i];
      apply(pose, v[0], v[1], v[2], vertices[i].data());
    }
  }

  PosedTriangle triangle(std::uint32_t index) const {
    const int* corners = &mesh->corners[3 * index];
    PosedTriangle out;
    for (int i = 0; i < 3; ++i) std::copy_n(vertices[corners[i]].data(), 3, out.corner[i]);
    return out;
  }
};

void bounds(const RTCBoundsFunctionArguments* arguments) {
  const auto& body = *static_cast<const EmbreeBody*>(arguments->geometryUserPtr);
  const PosedTriangle t = body.triangle(arguments->primID);
  const auto least = [&](int k) {
    return rounded_down(std::min({t.corner[0][k], t.corner[1][k], t.corner[2][k]}));
  };
  const auto most = [&](int k) {
    return rounded_up(std::max({t.corner[0][k], t.corner[1][k], t.corner[2][k]}));
  };
  RTCBounds& out = *arguments->bounds_o;
  out.lower_x = least(0), out.lower_y = least(1), out.lower_z = least(2);
  out.upper_x = most(0), out.upper_y = most(1), out.upper_z = most(2);
}

/// The data that rtcCollide's callback works on.
struct Collision {
  const EmbreeBody *a, *b;
  std::uint32_t pair;
  std::uint64_t candidates;
  std::vector<TriangleContact>* contacts;
};

void decide(void* user, RTCCollision* found, unsigned count) {
  auto& collision = *static_cast<Collision*>(user);
  const auto &a = *collision.a, &b = *collision.b;
  collision.candidates += count;
  for (unsigned i = 0; i < count; ++i) {
    const std::uint32_t triangle_a = found[i].primID0, triangle_b = found[i].primID1;
    if (meet_in_float64(a.triangle(triangle_a), b.triangle(triangle_b))) {
      collision.contacts->push_back({collision.pair, triangle_a, triangle_b});
    }
  }
}

/// Says how the trees follow the bodies: made anew each frame, or their boxes fitted again.
enum class Following { rebuild, refit };

class EmbreeEngine final : public EngineWith<IndexedMesh> {
 public:
  EmbreeEngine(std::string_view name, Following following)
      : EngineWith(name), following_(following), device_(rtcNewDevice("threads=1,set_affinity=0")) {
    if (device_ == nullptr) throw std::runtime_error("Embree: no device");
  }
  ~EmbreeEngine() override {
    clear_bodies();
    rtcReleaseDevice(device_);
  }

  std::string label() const override { return rebuilds() ? "Embree" : "Embree refit"; }
  std::string settings() const override {
    return std::string("rtcCollide, a world-space tree for every body, ") +
           (rebuilds() ? "made anew (medium quality)" : "refitted") +
           " in every frame, triangles decided in float64";
  }

  void query(std::span<const ObjectPair> pairs) override {
    LibraryEngine::query(pairs);
    throw_on_error();
  }

 private:
  bool rebuilds() const { return following_ == Following::rebuild; }

  void clear_shapes() override {
    clear_bodies();
    EngineWith::clear_shapes();
  }

  void clear_bodies() {
    for (const EmbreeBody& body : bodies_) rtcReleaseScene(body.scene), rtcReleaseGeometry(body.geometry);
    bodies_.clear();
  }
  void make_bodies(std::span<const Pose> poses) override {
    clear_bodies();
    bodies_.resize(poses.size());
    for (std::uint32_t i = 0; i < bodies_.size(); ++i) {
      bodies_[i].mesh = &shape(i);
      bodies_[i].place(poses[i]);
      make_scene(bodies_[i]);
    }
    throw_on_error();
  }

  void place(std::span<const Pose> poses) override {
    for (std::size_t i = 0; i < poses.size(); ++i) place(bodies_[i], poses[i]);
    throw_on_error();
  }

  static void place(EmbreeBody& body, const Pose& pose) {
    body.place(pose);
    rtcCommitGeometry(body.geometry);
    rtcCommitScene(body.scene);
  }

  void move_vertices(std::uint32_t shape, std::span<const double> vertices) override {
    std::transform(vertices.begin(), vertices.end(), kept(shape).vertices.begin(),
                   [](double x) { return static_cast<float>(x); });
  }

  void follow(std::uint32_t shape, std::span<const Pose> poses) override {
    for (std::size_t i = 0; i < poses.size(); ++i) {
      if (shape_of()[i] == shape) place(bodies_[i], poses[i]);
    }
    throw_on_error();
  }

  void collide(std::uint32_t pair, std::uint32_t a, std::uint32_t b) override {
    Collision collision = {&bodies_[a], &bodies_[b], pair, 0, &contacts_};
    rtcCollide(bodies_[a].scene, bodies_[b].scene, decide, &collision);
    candidates_ += collision.candidates;
  }

  // Embree refits what is of quality REFIT in a dynamic scene of quality LOW, and nothing else.
  void make_scene(EmbreeBody& body) {
    const bool refit = !rebuilds();
    body.geometry = rtcNewGeometry(device_, RTC_GEOMETRY_TYPE_USER);
    rtcSetGeometryUserPrimitiveCount(body.geometry, static_cast<unsigned>(body.mesh->triangle_count()));
    rtcSetGeometryUserData(body.geometry, &body);
    rtcSetGeometryBoundsFunction(body.geometry, bounds, nullptr);
    rtcSetGeometryBuildQuality(body.geometry, refit ? RTC_BUILD_QUALITY_REFIT : RTC_BUILD_QUALITY_MEDIUM);
    rtcCommitGeometry(body.geometry);
    body.scene = rtcNewScene(device_);
    rtcSetSceneFlags(body.scene, refit ? RTC_SCENE_FLAG_DYNAMIC : RTC_SCENE_FLAG_NONE);
    rtcSetSceneBuildQuality(body.scene, refit ? RTC_BUILD_QUALITY_LOW : RTC_BUILD_QUALITY_MEDIUM);
    rtcAttachGeometry(body.scene, body.geometry);
    rtcCommitScene(body.scene);
  }

  void throw_on_error() const {
    if (const RTCError error = rtcGetDeviceError(device_); error != RTC_ERROR_NONE) {
      throw std::runtime_error("Embree: error " + std::to_string(error));
    }
  }

  Following following_;
  RTCDevice device_;
  std::vector<EmbreeBody> bodies_;
};

}  // namespace

std::unique_ptr<Engine> make_embree_probes(std::string_view name);

std::unique_ptr<Engine> make_embree(std::string_view name, const Question& question) {
  if (std::holds_alternative<ProbeOptions>(question)) return make_embree_probes(name);
  return std::make_unique<EmbreeEngine>(name, name == "embree-refit" ? Following::refit : Following::rebuild);
}

}  // namespace tandem
