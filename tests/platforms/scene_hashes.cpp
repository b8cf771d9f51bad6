// Prints the object pairs, the contacts, and the hash of the contacts of scenes, as `bvhbench query` does, on
// systems that have no HDF5. The scenes are made by the functions of `bvhbench scene`, or their bodies bend
// as a file of positions says.
//
//     scene_hashes KIND COUNT BODY.bvh [GROUND.bvh]
//     scene_hashes bend BODY.bvh BESIDE.bvh X Y Z FILE...
//
// Second body BESIDE.bvh stands at X Y Z. A FILE holds the positions of the vertices of BODY.bvh, float32.
#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <map>
#include <span>
#include <string>
#include <vector>

#include "bvhbench/scenes/contact_table.h"
#include "bvhbench/scenes/make_scene.h"
#include "tandem/kernels/scene.h"
#include "tandem/runtime/map.h"

namespace tandem::bench {
namespace {

void require(Status status, const char* step) {
  if (status == Status::kOk) return;
  std::fprintf(stderr, "%s: %s\n", step, explain(status));
  std::exit(1);
}

void print_contacts(Scene& scene, const std::vector<AssetView>& views) {
  ContactQuery query;
  require(query.find(scene, {}), "contacts");
  const ContactTable table = table_of(views, scene.instances(), query.pairs(), query.rows());
  std::printf("%zu %zu %016llx\n", table.pairs.size(), table.pair.size(),
              static_cast<unsigned long long>(hash_of(table)));
}

/// Files that stay open while views look at them.
class Assets {
 public:
  explicit Assets(std::span<char*> paths) : files_(paths.size()) {
    for (std::size_t i = 0; i < paths.size(); ++i) {
      require(files_[i].open(paths[i]), paths[i]);
      views_.push_back(files_[i].view());
    }
  }
  const std::vector<AssetView>& views() const { return views_; }

 private:
  std::vector<MappedAsset> files_;
  std::vector<AssetView> views_;
};

// The default values of `bvhbench scene`; a field has ten times as many fixed bodies as moving ones.
std::vector<Instance> made(const std::string& kind, std::uint32_t count, const std::vector<AssetView>& assets,
                           std::vector<Motion>& motion) {
  const AssetView& body = assets[0];
  if (kind == "stack") return make_stack(body, root_above(count, 3), 0.001, {});
  if (kind == "exact-stack") return make_stack(body, root_above(count, 3), 0, {});
  if (kind == "pile") return make_pile(body, count, 6.5, {});
  if (kind == "lattice") return make_lattice(body, count, 0.7, {});
  if (kind == "coincident") return make_coincident(body, count, {});
  if (kind == "slide" && assets.size() == 2) return make_slide(body, assets[1], count, 20, {});
  if (kind != "field") std::exit(2);
  motion.assign(11 * count, Motion::moving);
  std::fill_n(motion.begin(), 10 * count, Motion::fixed);
  return make_field(body, 10 * count, count, 0.7, {});
}

void ask_made(const std::string& kind, const char* count, std::span<char*> paths) {
  const Assets assets(paths);
  std::vector<Motion> motion;
  const std::vector<Instance> instances =
      made(kind, static_cast<std::uint32_t>(std::stoul(count)), assets.views(), motion);
  PairFilter filter;
  if (!motion.empty()) filter.motion = motion.data();
  Scene scene;
  require(scene.set_assets(assets.views()), "assets");
  require(scene.place(instances, filter), "place");
  print_contacts(scene, assets.views());
}

std::vector<float> read_positions(const char* path) {
  std::vector<float> positions;
  std::FILE* file = std::fopen(path, "rb");
  if (file == nullptr) require(Status::kFileNotFound, path);
  float read[1024];
  for (std::size_t count; (count = std::fread(read, sizeof(float), std::size(read), file)) > 0;)
    positions.insert(positions.end(), read, read + count);
  std::fclose(file);
  return positions;
}

void ask_bent(std::span<char*> words) {
  const Assets assets(words.first(2));
  Instance bodies[2] = {{0, kIdentityPose}, {1, kIdentityPose}};
  for (std::size_t k = 0; k < 3; ++k) bodies[1].pose.translation[k] = std::stod(words[2 + k]);
  Scene scene;
  require(scene.set_assets(assets.views()), "assets");
  require(scene.place(bodies), "place");
  for (const char* path : words.subspan(5)) {
    require(scene.deform(0, read_positions(path)), path);
    print_contacts(scene, assets.views());
  }
}

}  // namespace
}  // namespace tandem::bench

int main(int argc, char** argv) {
  using namespace tandem::bench;
  const std::span<char*> words(argv + 1, static_cast<std::size_t>(argc - 1));
  if (words.size() >= 7 && std::string(words[0]) == "bend") {
    ask_bent(words.subspan(1));
  } else if (words.size() == 3 || words.size() == 4) {
    ask_made(words[0], words[1], words.subspan(2));
  } else {
    return 2;
  }
}
