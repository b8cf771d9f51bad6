#pragma once
#include <array>
#include <compare>
#include <cstdint>
#include <memory>
#include <ostream>
#include <span>
#include <string>
#include <vector>

#include "build/sample_asset.h"
#include "kernels/asked.h"
#include "kernels/geometry/triangle_test.h"
#include "random_pose.h"
#include "tandem/kernels/contact_query.h"

/// Seeded scenes of small meshes, from harmless to hostile, and their contacts by brute force.
namespace tandem::test {

/// Returns the number of trials: `usual`, and with TANDEM_LONG=1 `factor` times as many.
int trials(int usual, int factor);

/// Assets in memory. Source face i of an asset is triangle i of its mesh.
class SampleAssets {
 public:
  void add(const Mesh& mesh, const std::array<double, 3>& origin = {},
           build::Imaginary imaginary = build::Imaginary::minimal);
  void add(const Mesh& mesh, const build::Image& file, const std::array<double, 3>& origin = {});

  std::uint32_t size() const { return static_cast<std::uint32_t>(meshes_.size()); }
  std::span<const AssetView> views() const { return views_; }
  const Mesh& mesh(std::uint32_t asset) const { return meshes_[asset]; }

 private:
  std::vector<std::unique_ptr<Bytes>> files_;
  std::vector<AssetView> views_;
  std::vector<Mesh> meshes_;
};

struct BodyScene {
  SampleAssets assets;
  std::vector<Instance> instances;
};

struct SceneFamily {
  const char* name;
  BodyScene (*make)(RandomPoses&);
};

inline std::ostream& operator<<(std::ostream& out, const SceneFamily& family) {
  return out << family.name;
}

const std::vector<SceneFamily>& scene_families();

// Scenes are made of these.

/// Triangles of one size at random places in [-1, 1].
Mesh soup(RandomPoses& random, std::uint32_t triangles, double size);
/// Triangles on the integer points of [0, size]; flat ones among them.
Mesh grid_soup(RandomPoses& random, std::uint32_t triangles, int size);
/// The closed surface of [-half_side, half_side], its faces cut into cells^2 squares of two triangles.
Mesh cube(float half_side, int cells = 1);
void scale(Mesh& mesh, double factor);

/// One of the 24 rotations that permute the axes.
Pose quarter_turn(RandomPoses& random);
/// A rotation of any kind that is_rigid() accepts: identity, quarter turn, nearly one of these, any, and not
/// quite orthonormal.
Pose any_rotation(RandomPoses& random);

/// Half the diagonal of the box about an asset.
double radius_of(const AssetView& asset);
/// Returns a pose with this rotation that puts the centre of the asset at a place.
Pose centred_at(const AssetView& asset, Pose pose, const double (&place)[3]);

/// A distance to ask about: any size beside the scene's; whole numbers, so that grids have ties, among them.
double any_distance(RandomPoses& random, const BodyScene& scene);

// Contacts.

/// A contact by instances and faces; instance a < b, or face a < b within one instance.
struct FaceContact {
  std::uint32_t a, b, face_a, face_b;
  auto operator<=>(const FaceContact&) const = default;
};
std::ostream& operator<<(std::ostream& out, const FaceContact& contact);
using FaceContacts = std::vector<FaceContact>;  // sorted

/// Returns what the last call found; a contact that was reported twice is there twice.
FaceContacts found_contacts(const test::Asked<ContactQuery>& query);

using PosedTriangle = std::array<std::array<double, 3>, 3>;

/// The vertices of an instance in world coordinates, as the design says, not by apply().
std::vector<PosedTriangle> posed_triangles(const BodyScene& scene, std::uint32_t instance);

TrianglePair pair_of(const PosedTriangle& a, const PosedTriangle& b);

/// decide_exact() on every pair of triangles of every two instances, and within each instance if selves.
FaceContacts all_contacts(const BodyScene& scene, bool selves);

/// The triangles of two instances, or within one.
FaceContacts all_contacts(const BodyScene& scene, std::uint32_t a, std::uint32_t b);

/// Whatever is needed to make the scene again in a debugger.
std::string text(const BodyScene& scene);

}  // namespace tandem::test
