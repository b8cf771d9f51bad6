#include <embree3/rtcore.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <stdexcept>

#include "float64_triangles.h"
#include "peer.h"
#include "peer_mesh.h"

namespace tandem::bench {
namespace {

float rounded_down(double x) {
  const float f = static_cast<float>(x);
  return f <= x ? f : std::nextafter(f, -std::numeric_limits<float>::infinity());
}

float rounded_up(double x) {
  const float f = static_cast<float>(x);
  return f >= x ? f : std::nextafter(f, std::numeric_limits<float>::infinity());
}

/// What one instance's scene is made of. Embree holds its address.
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

/// What rtcCollide's callback works on.
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

/// How the trees follow the bodies: made anew each frame, or their boxes fitted again.
enum class Following { rebuild, refit };

class EmbreePeer final : public TellingPeer {
 public:
  explicit EmbreePeer(Following following)
      : following_(following), device_(rtcNewDevice("threads=1,set_affinity=0")) {
    if (device_ == nullptr) throw std::runtime_error("Embree: no device");
  }
  EmbreePeer(const EmbreePeer&) = delete;
  EmbreePeer& operator=(const EmbreePeer&) = delete;
  ~EmbreePeer() override {
    for (const EmbreeBody& body : bodies_) rtcReleaseScene(body.scene), rtcReleaseGeometry(body.geometry);
    rtcReleaseDevice(device_);
  }

  std::string name() const override { return following_ == Following::rebuild ? "Embree" : "Embree refit"; }
  std::string settings() const override {
    return std::string("rtcCollide, a world-space tree for every body, ") +
           (following_ == Following::rebuild ? "made anew (medium quality)" : "refitted") +
           " in every frame, triangles decided in float64";
  }

  void build(std::span<const AssetView> assets, std::span<const Instance> instances) override {
    assets_ = assets;
    for (const AssetView& asset : assets) meshes_.push_back(index_mesh(asset.level()));
    bodies_.resize(instances.size());
    const std::vector<Pose> poses = stored_poses(assets_, instances);
    for (std::size_t i = 0; i < bodies_.size(); ++i) {
      bodies_[i].mesh = &meshes_[instances[i].asset];
      bodies_[i].place(poses[i]);
      make_scene(bodies_[i]);
    }
    throw_on_error();
  }

  void update(std::span<const Instance> instances) override {
    const std::vector<Pose> poses = stored_poses(assets_, instances);
    for (std::size_t i = 0; i < bodies_.size(); ++i) {
      bodies_[i].place(poses[i]);
      rtcCommitGeometry(bodies_[i].geometry);
      rtcCommitScene(bodies_[i].scene);
    }
    throw_on_error();
  }

  void query(std::span<const ObjectPair> pairs) override {
    contacts_.clear();
    candidates_ = 0;
    for (std::uint32_t pair = 0; pair < pairs.size(); ++pair) {
      const EmbreeBody &a = bodies_[pairs[pair].a], &b = bodies_[pairs[pair].b];
      Collision collision = {&a, &b, pair, 0, &contacts_};
      rtcCollide(a.scene, b.scene, decide, &collision);
      candidates_ += collision.candidates;
    }
    throw_on_error();
  }

  std::vector<Counter> counters() const override { return {{"candidates", candidates_}}; }

 private:
  // Embree refits what is of quality REFIT in a dynamic scene of quality LOW, and nothing else.
  void make_scene(EmbreeBody& body) {
    const bool refit = following_ == Following::refit;
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
  std::span<const AssetView> assets_;
  std::vector<IndexedMesh> meshes_;
  std::vector<EmbreeBody> bodies_;
  std::uint64_t candidates_ = 0;
};

}  // namespace

std::vector<std::unique_ptr<Peer>> make_embree_peers() {
  std::vector<std::unique_ptr<Peer>> peers;
  peers.push_back(std::make_unique<EmbreePeer>(Following::rebuild));
  peers.push_back(std::make_unique<EmbreePeer>(Following::refit));
  return peers;
}

}  // namespace tandem::bench
