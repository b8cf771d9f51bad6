#include "question.h"

#include "bvhbench/scenes/contacts_file.h"
#include "common/number_words.h"

namespace tandem::bench {

LoadedScene open_scene(const CommonArguments& arguments) {
  if (arguments.on_gpu() && arguments.told_threads) throw UsageError("--threads is for the backend cpu");
  LoadedScene scene = read_scene(arguments.scene);
  check_output(arguments, files_of(arguments.scene, scene));
  return scene;
}

ScenePairs::ScenePairs(const SceneDescription& scene) : filter_(scene.filter.view(excluded_)) {
  if (scene.pairs) given_ = normalised(*scene.pairs);
}

Report report_of(const CommonArguments& arguments, const char* command, const std::string& what,
                 const std::string& gpu) {
  Report report;
  report.line(arguments.scene + ": " + what + " on " + arguments.backend + ", " +
              (arguments.on_gpu() ? gpu : threads_words(arguments.threads())));
  report.add_json("tool", std::string("bvhbench ") + command);
  report.add_json("version", TANDEM_VERSION);
  report.add_attribute("tandem_version", TANDEM_VERSION);
  report.add_json("scene", arguments.scene);
  report.add_json("output", or_null(arguments.output));
  report.add("backend", arguments.backend);
  return report;
}

void add_setting(Report& report, const CommonArguments& arguments, const LoadedScene& scene) {
  report.add("given_pairs", scene.description.pairs.has_value());
  add_threads(report, arguments);
  report.add_json("assets", scene.assets.size());
  report.add_json("instances", scene.description.instances.size()).row("instances");
  report.add_json("triangles", triangles_of(scene));
}

void add_threads(Report& report, const CommonArguments& arguments) {
  report.add("threads", arguments.on_gpu() ? 0 : arguments.threads());
}

void add_object_pairs(Report& report, std::uint64_t count, const LoadedScene& scene) {
  report.add("object_pairs", count)
      .row("object pairs", Unit::count, scene.description.pairs ? "  given" : "  found");
}

void add_outcome(Report& report, std::uint64_t hash, const Seconds& seconds) {
  report.add("hash", hexadecimal(hash));
  report.add_attribute("repeats", seconds.size());
  report.add("seconds", times(seconds));
}

void add_gpu_name(Report& report, const GpuUse& gpu) {
  report.add_json("gpu", gpu.name);
}

void add_gpu_use(Report& report, const GpuUse& gpu) {
  report.add_json("gpu_bytes", gpu.bytes);
  report.add_json("gpu_bytes_bound", gpu.bytes_bound == 0 ? Json() : Json(gpu.bytes_bound));
  report.add_json("gpu_bytes_taken", gpu.bytes_taken);
  report.add_json("upload_seconds", gpu.upload);
}

ExitCode finish(const CommonArguments& arguments, Report& report,
                const std::function<void(Hdf5Output&)>& add_datasets) {
  if (!arguments.output.empty()) {
    Hdf5Output file(arguments.output);
    add_datasets(file);
    file.attributes(report);
    file.write();
  }
  report["hash"].row("hash", Unit::words);
  print(arguments, report);
  return kDone;
}

}  // namespace tandem::bench
