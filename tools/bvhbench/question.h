#pragma once
#include <new>

#include "bvhbench/scenes/hdf5_file.h"
#include "command.h"
#include "common/stopwatch.h"

/// What the commands share that ask one question about the pairs of bodies of a scene: they open the scene,
/// let a query of the CPU or of a GPU answer, fill a report, and end with finish().
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

  /// Null where the query is to find the pairs.
  const std::vector<ObjectPair>* given() const { return given_ ? &*given_ : nullptr; }
  const PairFilter& filter() const { return filter_; }

 private:
  std::optional<std::vector<ObjectPair>> given_;
  ExcludedPairTable excluded_;
  PairFilter filter_;
};

/// Lets a query of the CPU answer as often as asked. bodies: has the shapes, and the pairs that are given or
/// null. ask: runs the query, with these pairs as its argument where they are given. Result: seconds,
/// counters and pairs. Throws what a status other than kOk calls for.
template <typename Found, typename Bodies, typename Query, typename Ask>
Found time_on_cpu(const CommonArguments& arguments, const Bodies& bodies, Query& query, const Ask& ask) {
  const auto require = [&](Status status) {
    if (status == Status::kOutOfMemory) throw std::bad_alloc();
    if (status != Status::kOk) refuse(arguments.scene, status, query.where());
  };
  require(query.set_assets(bodies.shapes));
  Found found;
  for (std::uint32_t i = 0; i < arguments.repeats; ++i) {
    Stopwatch watch;
    const Status status = bodies.given != nullptr ? ask(*bodies.given) : ask();
    found.seconds.push_back(watch.lap());
    require(status);
  }
  found.counters = query.counters();
  found.pairs.assign(query.pairs().begin(), query.pairs().end());
  return found;
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
