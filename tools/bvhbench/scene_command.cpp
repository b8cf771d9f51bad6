#include <algorithm>
#include <cstdio>

#include "bvhbench/scenes/make_scene.h"
#include "command.h"
#include "common/number_words.h"

namespace tandem::bench {
namespace {

struct SceneArguments : CommonArguments {
  std::string mesh, ground;
  std::uint32_t count = 0, fixed = 100'000, level = 0;
  double jitter = 0.001, neighbours = 6.5, spacing = 0.7, tilt = 20;
  bool exact = false;
  std::uint64_t seed = 1;
  std::vector<double> offset = {0, 0, 0};

  SceneSeed scene_seed() const { return {seed, {offset[0], offset[1], offset[2]}}; }
};

using Assets = std::vector<AssetView>;

// The bodies that are made of the arguments.
struct Bodies {
  std::vector<Instance> instances;
  std::vector<Motion> motion = {};
};
using Maker = std::function<Bodies(const SceneArguments&, const Assets&)>;

// The bodies' mesh at the level that is asked for.
AssetView body_of(const SceneArguments& arguments, const AssetView& mesh) {
  const std::size_t levels = mesh.levels.size();
  if (arguments.level < levels) return mesh.levels_from(arguments.level, 1);
  throw UsageError(arguments.mesh + ": has " + std::to_string(levels) + (levels == 1 ? " level" : " levels") +
                   ", so there is no level " + std::to_string(arguments.level));
}

// Returns the level of each instance; none where all are at level 0.
std::vector<std::uint32_t> levels_of(const SceneArguments& arguments,
                                     const std::vector<Instance>& instances) {
  std::vector<std::uint32_t> levels;
  if (arguments.level == 0) return levels;
  for (const Instance& instance : instances) levels.push_back(instance.asset == 0 ? arguments.level : 0);
  return levels;
}

ExitCode run(const SceneArguments& arguments, const Maker& make) {
  keep_inputs(arguments.output, {arguments.mesh, arguments.ground});
  std::vector<MappedAsset> meshes;
  Assets assets;
  SceneDescription scene;
  for (const std::string& path : {arguments.mesh, arguments.ground}) {
    if (path.empty()) continue;
    meshes.push_back(open_mesh(path));
    assets.push_back(assets.empty() ? body_of(arguments, meshes.back().view()) : meshes.back().view());
    scene.assets.push_back(seen_from(arguments.output, path));
  }
  std::uint64_t pairs = 0;
  try {
    Bodies bodies = make(arguments, assets);
    scene.instances = std::move(bodies.instances);
    scene.level = levels_of(arguments, scene.instances);
    scene.filter.motion = std::move(bodies.motion);
    ExcludedPairTable excluded;
    pairs = find_box_pairs(assets, scene.instances, scene.filter.view(excluded)).size();
  } catch (const std::runtime_error& impossible) {
    throw UsageError(arguments.mesh + ": " + impossible.what());
  }
  write_scene(arguments.output, scene);
  std::printf("%s: %s instances, %s object pairs, %.2f neighbours each\n", arguments.output.c_str(),
              with_commas(scene.instances.size()).c_str(), with_commas(pairs).c_str(),
              2 * static_cast<double>(pairs) / static_cast<double>(scene.instances.size()));
  return kDone;
}

// A subcommand for a kind of scene, with the options that all kinds have.
std::pair<Command, SceneArguments&> add_kind(Command scene, Run& run_later, const char* kind,
                                             const char* help, std::uint32_t count, const Maker& make) {
  const auto [command, arguments] = add_command<SceneArguments>(
      scene, run_later, kind, help, [=](const SceneArguments& told) { return run(told, make); });
  command.add(
      {mesh_option(arguments.mesh),
       count_option(arguments.count, count),
       {"--level", arguments.level, "N [0]", "of detail of the bodies; 0: the finest", between(0, 1.8e19)},
       seed_option(arguments.seed, "another scene of the kind"),
       {"--offset", arguments.offset, "X Y Z [0 0 0]", "added to every translation", between(-1e300, 1e300)},
       required(
           output_option(arguments, "the scene file to write; appears whole or not at all", "-o,--output"))});
  command.take_values("--offset", 3);
  return {command, arguments};
}

// The spacing of kinds on a lattice.
OptionRow spacing_option(SceneArguments& arguments) {
  return {"--spacing", arguments.spacing, "S [0.7]", "of the lattice, in lengths of the body's longest side",
          between(0.01, 1000)};
}

}  // namespace

void add_scene(Command tool, Run& run_later) {
  const Command scene = tool.add_command("scene", "make a scene file of many posed meshes");
  scene.require_command();
  const auto add = [&](const char* kind, const char* help, std::uint32_t count, const Maker& make) {
    return add_kind(scene, run_later, kind, help, count, make);
  };

  const auto [stack, stacked] =
      add("stack", "a cube of boxes, face to face", 1000, [](const auto& a, const Assets& assets) {
        return Bodies{make_stack(assets[0], root_above(a.count, 3), a.exact ? 0 : a.jitter, a.scene_seed())};
      });
  stack.check("--count", cube_defect);
  stack.add({{"--jitter", stacked.jitter, "J [0.001]", "how far boxes are moved at most, in box lengths",
              between(0, 0.5)},
             {"--exact", stacked.exact, "faces coincide exactly"}});
  stack.exclude("--exact", "--jitter");

  const auto [pile, piled] = add("pile", "bodies at random rotations, close together", 1000,
                                 [](const auto& a, const Assets& assets) {
                                   return Bodies{make_pile(assets[0], a.count, a.neighbours, a.scene_seed())};
                                 });
  pile.add({{"--neighbours", piled.neighbours, "N [6.5]",
             "bodies whose world box meets that of a body, on average", between(0.01, 1000)}});

  const auto [lattice, placed] =
      add("lattice", "bodies at random rotations on a lattice of a given spacing", 1000,
          [](const auto& a, const Assets& assets) {
            return Bodies{make_lattice(assets[0], a.count, a.spacing, a.scene_seed())};
          });
  lattice.add({spacing_option(placed)});
  const auto [field, heaped] =
      add("field", "a heap of moving bodies on a layer of fixed ones", 1000,
          [](const auto& a, const Assets& assets) {
            Bodies bodies = {make_field(assets[0], a.fixed, a.count, a.spacing, a.scene_seed())};
            bodies.motion.assign(bodies.instances.size(), Motion::moving);
            std::fill_n(bodies.motion.begin(), a.fixed, Motion::fixed);
            return bodies;
          });
  field.add({{"--fixed", heaped.fixed, "N [100000]", "how many fixed ones", between(0, 10'000'000)},
             spacing_option(heaped)});

  const auto [slide, sliding] = add(
      "slide", "bodies strewn on a tilted sheet of ground", 2500, [](const auto& a, const Assets& assets) {
        return Bodies{make_slide(assets[0], assets[1], a.count, a.tilt, a.scene_seed())};
      });
  slide.add({ground_option(sliding.ground, "sheet"),
             {"--tilt", sliding.tilt, "DEGREES [20]", "slope of the ground along x", between(-90, 90)}});

  add("coincident", "pairs of bodies in exactly the same pose", 50, [](const auto& a, const Assets& assets) {
    return Bodies{make_coincident(assets[0], a.count, a.scene_seed())};
  });
}

}  // namespace tandem::bench
