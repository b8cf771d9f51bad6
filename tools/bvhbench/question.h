#pragma once
#include "bvhbench/engines/registry.h"
#include "bvhbench/scenes/hdf5_file.h"
#include "command.h"

/// Commands that ask one question about the pairs of bodies of a scene share these functions: they open the
/// scene, let a query of the CPU or of a GPU answer, fill a report, and end with finish().
namespace tandem::bench {

/// Reads the scene. Throws where the options contradict each other, and where the file that is to be written
/// would replace one that is read, or cannot be written.
LoadedScene open_scene(const CommonArguments& arguments);

/// The pairs that a scene's file gives, normalised, and its filter of those that a query finds.
class ScenePairs {
 public:
  explicit ScenePairs(const SceneDescription& scene);
  ScenePairs(const ScenePairs&) = delete;
  ScenePairs& operator=(const ScenePairs&) = delete;

  /// Returns the pairs, or null where the query is to find them.
  const std::vector<ObjectPair>* given() const { return given_ ? &*given_ : nullptr; }
  const PairFilter& filter() const { return filter_; }

 private:
  std::optional<std::vector<ObjectPair>> given_;
  ExcludedPairTable excluded_;
  PairFilter filter_;
};

/// Asks Tandem, on the CPU or a GPU, a question about the bodies of a scene. shapes: of its assets;
/// ask(engine, asked): times the question of an engine that has the bodies, which move as told where there is
/// motion. Result: what `ask` finds. Errors of engines end the command.
template <typename Ask>
auto ask_engine(const CommonArguments& arguments, const LoadedScene& scene, std::span<const AssetView> shapes,
                const Question& question, const Ask& ask, std::span<const RigidMotion> motion = {},
                double duration = 0) {
  const ScenePairs pairs(scene.description);
  return answer_of(arguments.scene, scene, [&] {
    const auto engine = make_engine(arguments.on_gpu() ? "tandem-cuda" : "tandem", question);
    engine->set_threads(arguments.threads());
    engine->set_shapes(shapes);
    engine->set_filter(pairs.filter());
    if (!motion.empty()) engine->set_motion(motion, duration);
    engine->update(scene.description.instances);
    return ask(*engine, TimedQuery{pairs.given(), arguments.repeats});
  });
}

/// The beginning of a report: the command, its files, and what it ran on. what: of the title; gpu: what
/// stands there for a GPU.
Report report_of(const CommonArguments& arguments, const char* command, const std::string& what,
                 const std::string& gpu);

/// Adds where the pairs come from, the threads, and the size of the scene.
void add_setting(Report& report, const CommonArguments& arguments, const LoadedScene& scene);
/// Adds the threads; 0 on a GPU.
void add_threads(Report& report, const CommonArguments& arguments);
/// Adds the number of object pairs, and a row that says whether they were given.
void add_object_pairs(Report& report, std::uint64_t count, const LoadedScene& scene);
/// Adds the hash of what was found, and the seconds of each repeat.
void add_outcome(Report& report, std::uint64_t hash, const Seconds& seconds);
/// Adds the name of a GPU, to JSON alone; and what was taken of it.
void add_gpu_name(Report& report, const GpuUse& gpu);
void add_gpu_use(Report& report, const GpuUse& gpu);

/// Writes the file that was asked for, whose datasets `add_datasets` adds and whose attributes the report
/// has, and prints the report. The hash is its last row.
ExitCode finish(const CommonArguments& arguments, Report& report,
                const std::function<void(Hdf5Output&)>& add_datasets);

}  // namespace tandem::bench
