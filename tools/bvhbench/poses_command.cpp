#include "poses_command.h"

#include <cmath>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <thread>

#include "bvhbench/scenes/hdf5_file.h"
#include "common/json.h"
#include "common/number_words.h"
#include "parallel/parallel.h"
#include "pose_work.h"

namespace tandem::bench {
namespace {

const std::map<std::string, PoseSet> kSets = {{"training", PoseSet::training},
                                              {"validation", PoseSet::validation}};

struct PosesArguments {
  std::vector<std::string> trees;
  std::string with, poses, output;
  std::uint32_t count = 1000;
  std::uint64_t seed = 1;
  PoseSet set = PoseSet::validation;
  std::uint32_t threads = 1;
  bool json = false;

  std::string set_name() const { return set == PoseSet::training ? "training" : "validation"; }
};

// The trees in the order given, and the second body, if it is not the tree itself.
struct Bodies {
  std::vector<MappedAsset> files;
  std::vector<NamedAsset> trees;
  std::optional<NamedAsset> with;

  NamedAsset open(const std::string& path) {
    files.push_back(open_mesh(path));
    return {path, files.back().view()};
  }

  const NamedAsset& second(const NamedAsset& tree) const { return with ? *with : tree; }
};

// What is measured: poses of the second body, and their notes.
struct Poses {
  std::vector<Pose> of_b;
  PoseNotes notes;
};

void check_geometry(const NamedAsset& asset, const std::string& expected, const std::string& from) {
  if (hexadecimal(geometry_hash(asset.view)) == expected) return;
  throw FileError(asset.path + ": holds other triangles than the mesh that " + from + " is for");
}

Poses make(const PosesArguments& arguments, const Bodies& bodies) {
  const NamedAsset& a = bodies.trees[0];
  Poses poses;
  for (const NearContactPose& pose :
       make_poses(a, bodies.second(a), arguments.count, arguments.seed, arguments.set)) {
    poses.of_b.push_back(pose.b);
    poses.notes.depth.push_back(pose.depth);
  }
  poses.notes.stream = {arguments.set_name(), std::to_string(arguments.seed)};
  poses.notes.geometry = {hexadecimal(geometry_hash(a.view))};
  if (bodies.with) poses.notes.geometry.push_back(hexadecimal(geometry_hash(bodies.with->view)));
  return poses;
}

// Whether the scene is one that write() below makes.
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
  return (std::filesystem::path(arguments.poses).parent_path() / scene.assets[1]).string();
}

// A scene file, with what each tree did beside it.
void write(const std::string& path, const Bodies& bodies, const Poses& poses,
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
  const auto add = [&](const char* name, std::vector<std::uint32_t> PoseWork::*column) {
    std::vector<std::uint32_t> all;
    for (const PoseWork& of_tree : work) {
      all.insert(all.end(), (of_tree.*column).begin(), (of_tree.*column).end());
      all.resize(all.size() + poses.of_b.size() - (of_tree.*column).size());
    }
    file.add(name, {work.size(), poses.of_b.size()}, all);
  };
  add("/counts/block_pairs", &PoseWork::block_pairs);
  add("/counts/candidates", &PoseWork::candidates);
  add("/counts/oriented_block_pairs", &PoseWork::oriented_block_pairs);
  add("/counts/oriented_candidates", &PoseWork::oriented_candidates);
  add("/counts/contacts", &PoseWork::contacts);
  file.write();
}

Json number(double value) {
  return std::isfinite(value) ? Json(value) : Json();
}

Json to_json(const std::vector<std::uint32_t>& values, const std::vector<std::uint32_t>& base, double unit) {
  if (values.empty()) return {};
  const Spread spread = spread_of(values);
  const Ratio ratio = ratio_of(values, base);
  return {{"mean", unit * spread.mean},
          {"standard_error", number(unit * spread.standard_error)},
          {"quartiles", {unit * spread.lower_quartile, unit * spread.median, unit * spread.upper_quartile}},
          {"ratio", number(ratio.value)},
          {"ratio_standard_error", number(ratio.standard_error)}};
}

void print_json(const PosesArguments& arguments, const Bodies& bodies, const Poses& poses,
                const std::vector<PoseWork>& work) {
  constexpr double kBoxTests = kNodesPerBlock * kNodesPerBlock;
  const auto or_null = [](const std::string& text) { return text.empty() ? Json() : Json(text); };
  Json trees = Json::array();
  for (std::size_t i = 0; i < work.size(); ++i) {
    trees.push_back(
        {{"file", bodies.trees[i].path},
         {"triangles", bodies.trees[i].view.level().triangle_count},
         {"block_pairs", to_json(work[i].block_pairs, work[0].block_pairs, 1)},
         {"box_tests", to_json(work[i].block_pairs, work[0].block_pairs, kBoxTests)},
         {"candidates", to_json(work[i].candidates, work[0].candidates, 1)},
         {"oriented_block_pairs", to_json(work[i].oriented_block_pairs, work[0].oriented_block_pairs, 1)},
         {"oriented_candidates", to_json(work[i].oriented_candidates, work[0].oriented_candidates, 1)},
         {"contacts", to_json(work[i].contacts, work[0].contacts, 1)}});
  }
  const Json json = {{"tool", "bvhbench poses"},
                     {"version", TANDEM_VERSION},
                     {"poses", or_null(arguments.poses)},
                     {"output", or_null(arguments.output)},
                     {"with", bodies.with ? Json(bodies.with->path) : Json()},
                     {"set", poses.notes.stream[0]},
                     {"seed", poses.notes.stream[1]},
                     {"count", poses.of_b.size()},
                     {"trees", trees}};
  std::puts(pretty(json).c_str());
}

void print_counter(const char* name, const std::vector<std::uint32_t>& values,
                   const std::vector<std::uint32_t>& base, bool first) {
  if (values.empty()) {
    std::printf("  %-20s %11s\n", name, "-");
    return;
  }
  const Spread spread = spread_of(values);
  std::printf("  %-20s %11.1f  %8.1f  %9.0f %9.0f %9.0f", name, spread.mean, spread.standard_error,
              spread.lower_quartile, spread.median, spread.upper_quartile);
  const Ratio ratio = ratio_of(values, base);
  if (!first && std::isfinite(ratio.value)) std::printf("   x%.3f  %.3f", ratio.value, ratio.standard_error);
  std::puts("");
}

void print_text(const Bodies& bodies, const Poses& poses, const std::vector<PoseWork>& work) {
  std::printf("%s %s poses near contact, seed %s%s%s\n", with_commas(poses.of_b.size()).c_str(),
              poses.notes.stream[0].c_str(), poses.notes.stream[1].c_str(), bodies.with ? ", with " : "",
              bodies.with ? bodies.with->path.c_str() : "");
  std::printf("%-22s %11s  %8s  %9s %9s %9s%s\n", "", "mean", "error", "quarter", "median", "3 quarters",
              work.size() > 1 ? "  to the first  error" : "");
  for (std::size_t i = 0; i < work.size(); ++i) {
    std::printf("%s\n", bodies.trees[i].path.c_str());
    print_counter("block pairs", work[i].block_pairs, work[0].block_pairs, i == 0);
    print_counter("candidates", work[i].candidates, work[0].candidates, i == 0);
    print_counter("oriented block pairs", work[i].oriented_block_pairs, work[0].oriented_block_pairs, i == 0);
    print_counter("oriented candidates", work[i].oriented_candidates, work[0].oriented_candidates, i == 0);
    print_counter("contacts", work[i].contacts, work[0].contacts, i == 0);
  }
}

ExitCode run(const PosesArguments& arguments) {
  Bodies bodies;
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

  const parallel::ThreadLimit limit(arguments.threads);
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
  if (arguments.json) {
    print_json(arguments, bodies, poses, work);
  } else {
    print_text(bodies, poses, work);
  }
  return kDone;
}

}  // namespace

CLI::App* add_poses(CLI::App& app, Run& run_later) {
  const auto arguments = std::make_shared<PosesArguments>();
  arguments->threads = std::max(1u, std::thread::hardware_concurrency());
  CLI::App* command =
      app.add_subcommand("poses", "measure trees by the work of queries in random poses near contact");
  command->add_option("TREE", arguments->trees, ".bvh files over one mesh, measured in the same poses")
      ->required()
      ->check(file_name());
  command->add_option("--with", arguments->with, ".bvh file of the second body [the tree itself]")
      ->check(file_name());
  CLI::Option* poses =
      command->add_option("--poses", arguments->poses, "take the poses of this file, which -o wrote")
          ->check(file_name());
  const auto add = [&](CLI::Option* option, const char* text) { option->option_text(text)->excludes(poses); };
  add(command->add_option("--count", arguments->count, "poses")->check(CLI::Range(1, 1'000'000)), "N [1000]");
  add(command->add_option("--seed", arguments->seed, "other poses")->check(CLI::NonNegativeNumber), "N [1]");
  add(add_choice(*command, "--set", kSets, arguments->set, "which of two streams, with nothing in common"),
      "training|validation [validation]");
  command->add_option("--threads", arguments->threads, "threads; the figures do not depend on them")
      ->check(CLI::Range(1u, kMostSceneThreads))
      ->option_text("N [all]");
  command
      ->add_option("-o,--output", arguments->output,
                   "write the poses and each one's figures: a scene file; appears whole or not at all")
      ->check(file_name());
  command->add_flag("--json", arguments->json, "print the figures as JSON");
  command->final_callback([arguments, &run_later] { run_later = [arguments] { return run(*arguments); }; });
  return command;
}

}  // namespace tandem::bench
