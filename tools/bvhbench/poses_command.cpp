#include <cmath>

#include "bvhbench/scenes/hdf5_file.h"
#include "command.h"
#include "common/number_words.h"
#include "parallel/parallel.h"
#include "pose_work.h"

namespace tandem::bench {
namespace {

const std::map<std::string, PoseSet> kSets = {{"training", PoseSet::training},
                                              {"validation", PoseSet::validation}};

struct PosesArguments : CommonArguments {
  std::vector<std::string> trees;
  std::string with, poses;
  std::uint32_t count = 1000;
  std::uint64_t seed = 1;
  PoseSet set = PoseSet::validation;
};

// A counter of each pose.
struct PoseCounter {
  const char *key, *label;  // label: in the text; null: it is in JSON alone
  std::vector<std::uint32_t> PoseWork::*column;
  double unit;  // by which the column is multiplied
};
constexpr PoseCounter kPoseCounters[] = {
    {"block_pairs", "block pairs", &PoseWork::block_pairs, 1},
    {"box_tests", nullptr, &PoseWork::block_pairs, kNodesPerBlock* kNodesPerBlock},
    {"candidates", "candidates", &PoseWork::candidates, 1},
    {"oriented_block_pairs", "oriented block pairs", &PoseWork::oriented_block_pairs, 1},
    {"oriented_candidates", "oriented candidates", &PoseWork::oriented_candidates, 1},
    {"contacts", "contacts", &PoseWork::contacts, 1},
};

// The trees in the order given, and the second body, if it is not the tree itself.
struct Trees {
  std::vector<MappedAsset> files;
  std::vector<NamedAsset> trees;
  std::optional<NamedAsset> with;

  NamedAsset open(const std::string& path) {
    files.push_back(open_mesh(path));
    return {path, files.back().view()};
  }

  const NamedAsset& second(const NamedAsset& tree) const { return with ? *with : tree; }
};

// The poses of the second body that are measured, and their notes.
struct Poses {
  std::vector<Pose> of_b;
  PoseNotes notes;
};

void check_geometry(const NamedAsset& asset, const std::string& expected, const std::string& from) {
  if (hexadecimal(geometry_hash(asset.view)) == expected) return;
  throw FileError(asset.path + ": holds other triangles than the mesh that " + from + " is for");
}

Poses make(const PosesArguments& arguments, const Trees& bodies) {
  const NamedAsset& a = bodies.trees[0];
  Poses poses;
  for (const NearContactPose& pose :
       make_poses(a, bodies.second(a), arguments.count, arguments.seed, arguments.set)) {
    poses.of_b.push_back(pose.b);
    poses.notes.depth.push_back(pose.depth);
  }
  poses.notes.stream = {name_of(arguments.set, kSets), std::to_string(arguments.seed)};
  poses.notes.geometry = {hexadecimal(geometry_hash(a.view))};
  if (bodies.with) poses.notes.geometry.push_back(hexadecimal(geometry_hash(bodies.with->view)));
  return poses;
}

// Returns whether the scene is one that write() below makes.
bool is_of_poses(const SceneDescription& scene) {
  const std::size_t count = scene.instances.size(), assets = scene.assets.size();
  if (!scene.poses || !scene.pairs || !scene.level.empty() || count < 2 || assets < 1 || assets > 2)
    return false;
  const PoseNotes& notes = *scene.poses;
  if (notes.geometry.size() != assets || notes.stream.size() != 2 || notes.depth.size() != count - 1)
    return false;
  if (scene.pairs->size() != count - 1 || scene.instances[0].asset != 0) return false;
  for (std::size_t i = 1; i < count; ++i) {
    if (scene.instances[i].asset != assets - 1) return false;
    if ((*scene.pairs)[i - 1].a != 0 || (*scene.pairs)[i - 1].b != i) return false;
  }
  return true;
}

SceneDescription read(const std::string& path) {
  SceneDescription scene = read_description(path);
  if (is_of_poses(scene)) return scene;
  throw FileError(path + ": a scene, but none of poses as 'bvhbench poses' writes it");
}

Poses take(SceneDescription scene) {
  Poses poses;
  for (std::size_t i = 1; i < scene.instances.size(); ++i) poses.of_b.push_back(scene.instances[i].pose);
  poses.notes = std::move(*scene.poses);
  return poses;
}

// The second body of stored poses: as told, or as the file tells.
std::string second_of(const PosesArguments& arguments, const SceneDescription& scene) {
  if (scene.assets.size() == 1) {
    if (!arguments.with.empty()) throw UsageError(arguments.poses + ": is of one mesh; --with has no place");
    return {};
  }
  if (!arguments.with.empty()) return arguments.with;
  return beside(arguments.poses, scene.assets[1]);
}

// A scene file, with what each tree did beside it.
void write(const std::string& path, const Trees& bodies, const Poses& poses,
           const std::vector<PoseWork>& work) {
  SceneDescription scene;
  scene.assets = {seen_from(path, bodies.trees[0].path)};
  if (bodies.with) scene.assets.push_back(seen_from(path, bodies.with->path));
  const auto asset_of_b = static_cast<std::uint32_t>(scene.assets.size() - 1);
  scene.instances = {{0, kIdentityPose}};
  scene.pairs.emplace();
  for (const Pose& pose : poses.of_b) {
    scene.pairs->push_back({0, static_cast<std::uint32_t>(scene.instances.size())});
    scene.instances.push_back({asset_of_b, pose});
  }
  scene.poses = poses.notes;

  Hdf5Output file(path);
  add_scene(file, scene);
  std::vector<std::string> names;
  for (const NamedAsset& tree : bodies.trees) names.push_back(seen_from(path, tree.path));
  file.add("/counts/trees", names);
  for (const auto& [key, label, column, unit] : kPoseCounters) {
    if (label == nullptr) continue;
    std::vector<std::uint32_t> all;
    for (const PoseWork& of_tree : work) {
      all.insert(all.end(), (of_tree.*column).begin(), (of_tree.*column).end());
      all.resize(all.size() + poses.of_b.size() - (of_tree.*column).size());
    }
    file.add(std::string("/counts/") + key, {work.size(), poses.of_b.size()}, all);
  }
  file.write();
}

Json to_json(const std::vector<std::uint32_t>& values, const std::vector<std::uint32_t>& base, double unit) {
  if (values.empty()) return {};
  const Spread spread = spread_of(values);
  const Ratio ratio = ratio_of(values, base);
  return {{"mean", unit * spread.mean},
          {"standard_error", unit * spread.standard_error},
          {"quartiles", {unit * spread.lower_quartile, unit * spread.median, unit * spread.upper_quartile}},
          {"ratio", ratio.value},
          {"ratio_standard_error", ratio.standard_error}};
}

std::string to_text(const char* label, const std::vector<std::uint32_t>& values,
                    const std::vector<std::uint32_t>& base) {
  if (values.empty()) return format("%-20s %11s", label, "-");
  const Spread spread = spread_of(values);
  const std::string text =
      format("%-20s %11.1f  %8.1f  %9.0f %9.0f %9.0f", label, spread.mean, spread.standard_error,
             spread.lower_quartile, spread.median, spread.upper_quartile);
  const Ratio ratio = ratio_of(values, base);
  if (&values == &base || !std::isfinite(ratio.value)) return text;
  return text + format("   x%.3f  %.3f", ratio.value, ratio.standard_error);
}

Report report_of(const PosesArguments& arguments, const Trees& bodies, const Poses& poses,
                 const std::vector<PoseWork>& work) {
  const std::string &set = poses.notes.stream[0], &seed = poses.notes.stream[1];
  Report report;
  report.line(with_commas(poses.of_b.size()) + " " + set + " poses near contact, seed " + seed +
              (bodies.with ? ", with " + bodies.with->path : ""));
  report.add({{"tool", "bvhbench poses"},
              {"version", TANDEM_VERSION},
              {"poses", or_null(arguments.poses)},
              {"output", or_null(arguments.output)},
              {"with", bodies.with ? Json(bodies.with->path) : Json()},
              {"set", set},
              {"seed", seed},
              {"count", poses.of_b.size()}});
  report.line(format("%-22s %11s  %8s  %9s %9s %9s%s", "", "mean", "error", "quarter", "median", "3 quarters",
                     work.size() > 1 ? "  to the first  error" : ""));
  Json trees = Json::array();
  for (std::size_t i = 0; i < work.size(); ++i) {
    Json& tree = trees.emplace_back(
        Json{{"file", bodies.trees[i].path}, {"triangles", bodies.trees[i].view.level().triangle_count}});
    report.line(bodies.trees[i].path);
    for (const auto& [key, label, column, unit] : kPoseCounters) {
      const std::vector<std::uint32_t>&values = work[i].*column, &base = work[0].*column;
      tree[key] = to_json(values, base, unit);
      if (label != nullptr) report.line("  " + to_text(label, values, base));
    }
  }
  report.add("trees", std::move(trees));
  return report;
}

ExitCode run_poses(const PosesArguments& arguments) {
  Trees bodies;
  SceneDescription stored;
  std::string with = arguments.with;
  if (!arguments.poses.empty()) {
    stored = read(arguments.poses);  // in a child process: before there are threads
    with = second_of(arguments, stored);
  }
  if (!arguments.output.empty()) {
    keep_inputs(arguments.output, arguments.trees);
    keep_inputs(arguments.output, {with, arguments.poses});
  }
  for (const std::string& path : arguments.trees) bodies.trees.push_back(bodies.open(path));
  if (!with.empty()) bodies.with = bodies.open(with);

  const parallel::ThreadLimit limit(arguments.threads());
  const Poses poses = arguments.poses.empty() ? make(arguments, bodies) : take(std::move(stored));
  const std::string from = arguments.poses.empty() ? bodies.trees[0].path : arguments.poses;
  for (const NamedAsset& tree : bodies.trees) check_geometry(tree, poses.notes.geometry[0], from);
  if (bodies.with) check_geometry(*bodies.with, poses.notes.geometry[1], from);

  std::vector<PoseWork> work;
  for (const NamedAsset& tree : bodies.trees) {
    work.push_back(measure_poses(tree, bodies.second(tree), poses.of_b));
    if (work.back().contacts != work[0].contacts) {
      throw std::logic_error(tree.path + " and " + bodies.trees[0].path + " have other contacts");
    }
  }
  if (!arguments.output.empty()) write(arguments.output, bodies, poses, work);
  print(arguments, report_of(arguments, bodies, poses, work));
  return kDone;
}

}  // namespace

void add_poses(Command tool, Run& run_later) {
  const auto [command, arguments] = add_command<PosesArguments>(
      tool, run_later, "poses", "measure trees by the work of queries in random poses near contact",
      run_poses);
  command.add(
      {required({"TREE", arguments.trees, "", ".bvh files over one mesh, measured in the same poses",
                 file_name()}),
       {"--with", arguments.with, "", ".bvh file of the second body [the tree itself]", file_name()},
       {"--poses", arguments.poses, "", "take the poses of this file, which -o wrote", file_name()},
       {"--count", arguments.count, "N [1000]", "poses", between(1, 1'000'000)},
       seed_option(arguments.seed, "other poses"),
       {"--set", arguments.set, kSets, "training|validation [validation]",
        "which of two streams, with nothing in common"},
       threads_option(arguments, "the figures do"),
       output_option(arguments,
                     "write the poses and each one's figures: a scene file; appears whole or not at all",
                     "-o,--output"),
       json_option(arguments, "the figures")});
  for (const char* made : {"--count", "--seed", "--set"}) command.exclude(made, "--poses");
}

}  // namespace tandem::bench
