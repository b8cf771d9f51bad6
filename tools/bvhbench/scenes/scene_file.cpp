#include "scene_file.h"

#include <algorithm>
#include <filesystem>
#include <new>

#include "columns.h"
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

// An optional number of each instance.
std::vector<std::uint32_t> read_of_each(const Hdf5Input& file, const std::string& path,
                                        const std::string& name, std::size_t instances) {
  if (!file.has(name)) return {};
  std::vector<std::uint32_t> values = file.read_u32(name);
  if (values.size() == instances) return values;
  throw FileError(path + ": " + name + ": " + std::to_string(values.size()) + " rows for " +
                  std::to_string(instances) + " instances");
}

SceneFilter read_filter(const Hdf5Input& file, const std::string& path, std::size_t instances) {
  const auto of_each = [&](const std::string& name) { return read_of_each(file, path, name, instances); };
  SceneFilter filter;
  filter.group = of_each("/instances/group");
  filter.mask = of_each("/instances/mask");
  filter.world = of_each("/instances/world");
  for (const std::uint32_t motion : of_each("/simulation/motion")) {
    if (motion > static_cast<std::uint32_t>(Motion::sleeping)) {
      throw FileError(path + ": /simulation/motion: instance " + std::to_string(filter.motion.size()) + ": " +
                      std::to_string(motion) + " is none of 0 moving, 1 fixed, 2 kinematic, 3 sleeping");
    }
    filter.motion.push_back(static_cast<Motion>(motion));
  }
  if (file.has("/excluded")) filter.excluded = read_values<ObjectPair>(file, "/excluded");
  return filter;
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
  scene.level = read_of_each(file, path, "/instances/level", scene.instances.size());
  if (file.has("/pairs")) scene.pairs = read_values<ObjectPair>(file, "/pairs");
  if (file.has("/poses")) scene.poses = read_notes(file);
  scene.filter = read_filter(file, path, scene.instances.size());
  return scene;
}

// Refuses indices of something that the file has not got.
void check_indices(const SceneDescription& scene, const std::string& path) {
  for (std::size_t i = 0; i < scene.instances.size(); ++i) {
    if (scene.instances[i].asset < scene.assets.size()) continue;
    throw FileError(path + ": /instances/asset: instance " + std::to_string(i) + " is of asset " +
                    std::to_string(scene.instances[i].asset) + " of " + std::to_string(scene.assets.size()));
  }
  const auto check_pairs = [&](const char* name, const std::vector<ObjectPair>& pairs) {
    for (std::size_t i = 0; i < pairs.size(); ++i) {
      const std::uint32_t last = std::max(pairs[i].a, pairs[i].b);
      if (last < scene.instances.size()) continue;
      throw FileError(path + ": " + name + ": row " + std::to_string(i) + " names instance " +
                      std::to_string(last) + " of " + std::to_string(scene.instances.size()));
    }
  };
  if (scene.pairs) check_pairs("/pairs", *scene.pairs);
  check_pairs("/excluded", scene.filter.excluded);
}

// Levels that an asset has not got.
void check_levels(const LoadedScene& scene, const std::string& path) {
  const SceneDescription& told = scene.description;
  for (std::size_t i = 0; i < told.level.size(); ++i) {
    const std::uint32_t asset = told.instances[i].asset;
    const std::size_t levels = scene.assets[asset].view().levels.size();
    if (told.level[i] < levels) continue;
    throw FileError(path + ": /instances/level: instance " + std::to_string(i) + " is at level " +
                    std::to_string(told.level[i]) + " of " + told.assets[asset] + ", which has " +
                    std::to_string(levels));
  }
}

MappedAsset open_asset(const std::string& scene, const std::vector<std::string>& names, std::size_t i) {
  const std::string where = " (asset " + std::to_string(i) + " of " + scene + ")";
  if (names[i].empty()) throw FileError(scene + ": /assets: row " + std::to_string(i) + " is empty");
  const std::string path = beside(scene, names[i]);
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

PairFilter SceneFilter::view(ExcludedPairTable& table) const {
  if (table.set(excluded) != Status::kOk) throw std::bad_alloc();
  const auto of_each = [](const auto& values) { return values.empty() ? nullptr : values.data(); };
  return {of_each(motion), of_each(group), of_each(mask), of_each(world), table.view()};
}

void LoadedScene::add(MappedAsset asset) {
  shapes.push_back({static_cast<std::uint32_t>(assets.size())});
  assets.push_back(std::move(asset));
}

AssetView LoadedScene::view(std::uint32_t shape) const {
  return assets[shapes[shape].asset].view().levels_from(shapes[shape].level, 1);
}

std::vector<AssetView> LoadedScene::views() const {
  std::vector<AssetView> views;
  for (std::uint32_t i = 0; i < shapes.size(); ++i) views.push_back(view(i));
  return views;
}

std::vector<AssetView> LoadedScene::finest_views() const {
  std::vector<AssetView> views;
  for (const SceneShape& shape : shapes) views.push_back(assets[shape.asset].view());
  return views;
}

const std::string& LoadedScene::name_of(std::uint64_t shape) const {
  return description.assets[shapes[shape].asset];
}

void use_levels(LoadedScene& scene, std::span<const std::uint32_t> level) {
  std::vector<Instance>& instances = scene.description.instances;
  std::vector<SceneShape>& shapes = scene.shapes;
  shapes.clear();
  for (std::size_t i = 0; i < instances.size(); ++i) {
    const SceneShape shape = {instances[i].asset, level[i]};
    if (shapes.empty() || shapes.back() != shape) shapes.push_back(shape);
  }
  std::sort(shapes.begin(), shapes.end());
  shapes.erase(std::unique(shapes.begin(), shapes.end()), shapes.end());
  for (std::size_t i = 0; i < instances.size(); ++i) {
    const auto found =
        std::lower_bound(shapes.begin(), shapes.end(), SceneShape{instances[i].asset, level[i]});
    instances[i].asset = static_cast<std::uint32_t>(found - shapes.begin());
  }
}

MappedAsset open_mesh(const std::string& path) {
  MappedAsset asset;
  const Status status = asset.open(path.c_str());
  if (status != Status::kOk) throw FileError(path + ": " + explain(status));
  return asset;
}

std::string beside(const std::string& file, const std::string& named) {
  return (fs::path(file).parent_path() / named).string();
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

LoadedScene read_scene(const std::string& path) {
  LoadedScene scene;
  scene.description = read_description(path);
  for (std::size_t i = 0; i < scene.description.assets.size(); ++i) {
    scene.add(open_asset(path, scene.description.assets, i));
  }
  check_levels(scene, path);
  const std::vector<std::uint32_t>& level = scene.description.level;
  if (!level.empty()) use_levels(scene, level);
  return scene;
}

namespace {

void add_filter(Hdf5Output& file, const SceneFilter& filter) {
  const auto add = [&](const char* name, const std::vector<std::uint32_t>& values) {
    if (!values.empty()) file.add(name, {values.size()}, values);
  };
  std::vector<std::uint32_t> motion;
  for (const Motion of_each : filter.motion) motion.push_back(static_cast<std::uint32_t>(of_each));
  add("/instances/group", filter.group);
  add("/instances/mask", filter.mask);
  add("/instances/world", filter.world);
  add("/simulation/motion", motion);
  if (!filter.excluded.empty()) add_pairs(file, "/excluded", filter.excluded);
}

}  // namespace

void add_scene(Hdf5Output& file, const SceneDescription& scene) {
  std::vector<std::uint32_t> asset;
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
  if (!scene.level.empty()) file.add("/instances/level", {scene.level.size()}, scene.level);
  if (scene.pairs) add_pairs(file, "/pairs", *scene.pairs);
  add_filter(file, scene.filter);
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
