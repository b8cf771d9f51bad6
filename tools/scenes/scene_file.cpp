#include "scene_file.h"

#include <algorithm>
#include <filesystem>

#include "hdf5_file.h"
#include "scene_child.h"

namespace tandem::bench {
namespace {

namespace fs = std::filesystem;

std::vector<Instance> read_instances(const Hdf5Input& file, const std::string& path) {
  const auto asset = file.read_u32("/instances/asset");
  const auto rotation = file.read_f64("/instances/rotation", {3, 3});
  const auto translation = file.read_f64("/instances/translation", {3});
  if (rotation.size() != 9 * asset.size() || translation.size() != 3 * asset.size()) {
    throw FileError(path + ": /instances: " + std::to_string(asset.size()) + " assets, " +
                    std::to_string(rotation.size() / 9) + " rotations and " +
                    std::to_string(translation.size() / 3) + " translations");
  }
  std::vector<Instance> instances(asset.size());
  for (std::size_t i = 0; i < instances.size(); ++i) {
    instances[i].asset = asset[i];
    std::copy_n(&rotation[9 * i], 9, &instances[i].pose.rotation[0][0]);
    std::copy_n(&translation[3 * i], 3, instances[i].pose.translation);
  }
  return instances;
}

std::vector<ObjectPair> read_pairs(const Hdf5Input& file) {
  const auto flat = file.read_u32("/pairs", {2});
  std::vector<ObjectPair> pairs(flat.size() / 2);
  for (std::size_t i = 0; i < pairs.size(); ++i) pairs[i] = {flat[2 * i], flat[2 * i + 1]};
  return pairs;
}

PoseNotes read_notes(const Hdf5Input& file) {
  return {file.read_strings("/poses/geometry"), file.read_strings("/poses/stream"),
          file.read_f64("/poses/depth")};
}

SceneDescription read_file(const std::string& path) {
  const Hdf5Input file(path);
  SceneDescription scene;
  scene.assets = file.read_strings("/assets");
  scene.instances = read_instances(file, path);
  if (file.has("/pairs")) scene.pairs = read_pairs(file);
  if (file.has("/poses")) scene.poses = read_notes(file);
  return scene;
}

// What refers to something that the file has not got.
void check_indices(const SceneDescription& scene, const std::string& path) {
  for (std::size_t i = 0; i < scene.instances.size(); ++i) {
    if (scene.instances[i].asset < scene.assets.size()) continue;
    throw FileError(path + ": /instances/asset: instance " + std::to_string(i) + " is of asset " +
                    std::to_string(scene.instances[i].asset) + " of " + std::to_string(scene.assets.size()));
  }
  if (!scene.pairs) return;
  for (std::size_t i = 0; i < scene.pairs->size(); ++i) {
    const ObjectPair pair = (*scene.pairs)[i];
    if (std::max(pair.a, pair.b) < scene.instances.size()) continue;
    throw FileError(path + ": /pairs: row " + std::to_string(i) + " names instance " +
                    std::to_string(std::max(pair.a, pair.b)) + " of " +
                    std::to_string(scene.instances.size()));
  }
}

MappedAsset open_asset(const std::string& scene, const std::vector<std::string>& names, std::size_t i) {
  const std::string where = " (asset " + std::to_string(i) + " of " + scene + ")";
  if (names[i].empty()) throw FileError(scene + ": /assets: row " + std::to_string(i) + " is empty");
  const std::string path = (fs::path(scene).parent_path() / names[i]).string();
  MappedAsset asset;
  const Status status = asset.open(path.c_str());
  if (status == Status::kOk) return asset;
  std::string text = path + ": " + explain(status);
  if (const char* unit = subject(status); unit != nullptr) {
    text += std::string(" (") + unit + " " + std::to_string(asset.where()) + ")";
  }
  throw FileError(text + where);
}

}  // namespace

std::vector<AssetView> Scene::views() const {
  std::vector<AssetView> views;
  for (const MappedAsset& asset : assets) views.push_back(asset.view());
  return views;
}

MappedAsset open_mesh(const std::string& path) {
  MappedAsset asset;
  const Status status = asset.open(path.c_str());
  if (status != Status::kOk) throw FileError(path + ": " + explain(status));
  return asset;
}

std::string seen_from(const std::string& scene, const std::string& mesh) {
  const fs::path folder = fs::absolute(scene).parent_path();
  std::error_code error;
  const fs::path relative = fs::proximate(mesh, folder, error);
  return error ? fs::absolute(mesh).string() : relative.string();
}

SceneDescription read_description(const std::string& path) {
  SceneDescription scene = read_in_child(path, read_file);
  check_indices(scene, path);
  return scene;
}

Scene read_scene(const std::string& path) {
  Scene scene;
  scene.description = read_description(path);
  for (std::size_t i = 0; i < scene.description.assets.size(); ++i) {
    scene.assets.push_back(open_asset(path, scene.description.assets, i));
  }
  return scene;
}

void add_scene(Hdf5Output& file, const SceneDescription& scene) {
  std::vector<std::uint32_t> asset, pairs;
  std::vector<double> rotation, translation;
  for (const Instance& instance : scene.instances) {
    const double* first = &instance.pose.rotation[0][0];
    asset.push_back(instance.asset);
    rotation.insert(rotation.end(), first, first + 9);
    translation.insert(translation.end(), instance.pose.translation, instance.pose.translation + 3);
  }
  file.add("/assets", scene.assets);
  file.add("/instances/asset", {asset.size()}, asset);
  file.add("/instances/rotation", {asset.size(), 3, 3}, rotation);
  file.add("/instances/translation", {asset.size(), 3}, translation);
  if (scene.pairs) {
    for (const ObjectPair& pair : *scene.pairs) pairs.insert(pairs.end(), {pair.a, pair.b});
    file.add("/pairs", {scene.pairs->size(), 2}, pairs);
  }
  if (scene.poses) {
    file.add("/poses/geometry", scene.poses->geometry);
    file.add("/poses/stream", scene.poses->stream);
    file.add("/poses/depth", {scene.poses->depth.size()}, scene.poses->depth);
  }
}

void write_scene(const std::string& path, const SceneDescription& scene) {
  Hdf5Output file(path);
  add_scene(file, scene);
  file.write();
}

}  // namespace tandem::bench
