#include "pipeline.h"

#include "bvhbuild/import/input_file.h"
#include "bvhbuild/meshing/meshing.h"
#include "common/json.h"
#include "common/number_words.h"
#include "common/output_file.h"
#include "common/path_text.h"
#include "common/printable.h"
#include "import_samples.h"
#include "kernels/common/stopwatch.h"
#include "level_pipeline.h"
#include "parallel/parallel.h"
#include "tandem/formats/hash.h"
#include "terminal.h"

namespace tandem::build {
namespace {

namespace fs = std::filesystem;

Outcome& fail(Outcome& outcome, ExitCode code, const fs::path& file, const std::string& reason) {
  outcome.exit_code = code;
  outcome.error = text_of(file) + ": " + reason;
  return outcome;
}

// Returns what is known to be wrong with the output before hours of work go into it.
std::string output_defect(const Options& options, ExitCode& code) {
  std::error_code error;
  code = kUsage;
  if (fs::equivalent(options.input, options.output, error)) return "is the input; it would be overwritten";
  code = kUnwritableOutput;
  const fs::path folder = options.output.has_parent_path() ? options.output.parent_path() : ".";
  if (!fs::exists(folder, error)) return "there is no folder " + text_of(folder);
  if (fs::is_directory(options.output, error)) return "is a folder";
  return {};
}

/// "a; b; c".
std::string joined(const std::vector<std::string>& texts) {
  std::string all;
  for (const std::string& text : texts) all += (all.empty() ? "" : "; ") + text;
  return all;
}

/// Returns what --strict takes for an error; empty where there is nothing.
std::string all_defects(const Outcome& outcome) {
  std::vector<std::string> defects = outcome.remarks;
  for (const Finding& finding : findings(outcome.clean))
    if (finding.defect && finding.count > 0) defects.push_back(finding.what);
  return joined(defects);
}

std::string instead_of_faces(const Outcome& outcome, const LeftOut& left_out) {
  if (left_out.strip_turns) return "the triangles of its strips all name a vertex twice";
  if (left_out.lines)
    return left_out.points ? "it has points and lines but no faces" : "it has lines but no faces";
  if (left_out.points || outcome.clean.vertices > 0) return "it has points but no faces";
  return "it has no faces and no vertices";
}

/// Returns why a mesh has no triangle: its faces and what became of them, or what it has instead of faces.
std::string why_no_triangle(const Outcome& outcome, const LeftOut& left_out) {
  std::vector<std::string> causes;
  if (outcome.clean.faces == 0) causes.push_back(instead_of_faces(outcome, left_out));
  for (const Finding& finding : findings(outcome.clean))
    if (finding.loses_faces && finding.count > 0) causes.push_back(finding.what);
  causes.insert(causes.end(), outcome.remarks.begin(), outcome.remarks.end());
  return "holds no usable triangle: " + joined(causes);
}

InputDigest digest_of(const std::filesystem::path& path) {
  InputFile file;
  if (!file.open(path).empty() || !file.read_all().empty()) return {};
  return {file.bytes().size(), xxh64(file.bytes().data(), file.bytes().size())};
}

// Adds what the provenance says of the samples that the tree was made for.
void add_samples(const Options& options, const Outcome& outcome, Json& json) {
  if (outcome.samples.empty()) return;
  json["samples"] = samples_json(outcome.samples);
  for (std::size_t i = 0; i < outcome.poses.size(); ++i) {
    json["input"]["poses"].push_back({{"file", text_of(path_of(options.poses[i]).filename())},
                                      {"bytes", outcome.poses[i].bytes},
                                      {"xxh64", hexadecimal(outcome.poses[i].hash)}});
  }
}

/// The provenance section of a file: input, its hash, options that shape the tree, tool, what cleaning met.
/// Nothing that varies from run to run or with the number of threads, so that the same input gives the same
/// bytes. Keys in docs/json.md.
std::string provenance_json(const Options& options, const Outcome& outcome) {
  Json found = Json::object();
  for (const Finding& finding : findings(outcome.clean)) {
    if (finding.count > 0) found[finding.key] = finding.count;
  }
  Json shaping = {{"imaginary", name(options.imaginary)}, {"effort", name(options.effort)}};
  if (!options.gpu_blocks) shaping["gpu_blocks"] = false;
  if (!options.topology) shaping["topology"] = false;
  if (!options.refit) shaping["refit"] = false;
  if (!options.levels.empty()) {
    shaping["levels"] = Json::array();
    for (const LevelError& error : options.levels) shaping["levels"].push_back(name(error));
  }
  if (options.animation) shaping["animation"] = true;
  if (outcome.interrupted) shaping["interrupted"] = true;
  Json json = {{"tool", "bvhbuild"},
               {"version", TANDEM_VERSION},
               {"input",
                {{"file", text_of(options.input.filename())},
                 {"bytes", outcome.input.bytes},
                 {"xxh64", hexadecimal(outcome.input.hash)},
                 {"reader", outcome.reader},
                 {"faces", outcome.clean.faces},
                 {"vertices", outcome.clean.vertices}}},
               {"options", shaping},
               {"findings", found}};
  add_samples(options, outcome, json);
  return json.dump(-1, ' ', false, Json::error_handler_t::replace);
}

StoredMesh prepare(PolygonMesh& polygons, Outcome& outcome) {
  Stopwatch stopwatch;
  TriangleMesh triangles = triangulate(polygons, outcome.clean);
  clean(triangles, outcome.clean);
  StoredMesh mesh = to_single_precision(triangles, outcome.clean);
  std::copy(mesh.origin.begin(), mesh.origin.end(), outcome.origin);
  outcome.rounding_error = mesh.largest_rounding_error;
  outcome.seconds.clean = stopwatch.lap();
  return mesh;
}

Image build_image(const Options& options, const SampledImport& imported, const StoredMesh& mesh,
                  Progress& progress, Outcome& outcome) {
  Stopwatch stopwatch;
  OptimisationWatch watch;
  watch.progress = [&](double share) { progress.share(share); };
  const StopOnInterrupt interrupt(options.effort == Effort::best ? &watch.stop : nullptr);
  AssetSource source;
  source.source_faces = outcome.clean.faces;
  source.source_vertices = outcome.clean.vertices;
  source.parts = imported.read.mesh.parts;
  const auto provenance = [&] { return provenance_json(options, outcome); };
  auto [image, asset] = build_file(options, mesh, source, provenance, watch, outcome, imported.names);
  const FileHeader& header = *asset.header;
  outcome.tree = measure_tree(asset.level(), header.lower, header.upper);
  outcome.gpu_blocks = asset.level().oriented_blocks != nullptr;
  outcome.topology = asset.level().topology != nullptr;
  outcome.refit = asset.level().source_vertices != nullptr;
  outcome.hash = hexadecimal(header.hash);
  outcome.file_bytes = header.file_bytes;
  if (!options.levels.empty()) describe_levels(asset, outcome);
  outcome.seconds.build = stopwatch.lap();
  return std::move(image);
}

}  // namespace

Outcome run_pipeline(const Options& options) {
  Outcome outcome;
  if (const std::string defect = output_defect(options, outcome.exit_code); !defect.empty()) {
    return fail(outcome, outcome.exit_code, options.output, defect);
  }
  outcome.exit_code = kDone;
  Progress progress(!options.quiet, printable(text_of(options.input.filename())));

  progress.step("import");
  Stopwatch stopwatch;
  SampledImport imported = import_samples(options);
  outcome.input = digest_of(options.input);
  outcome.seconds.import = stopwatch.lap();
  for (const fs::path& pose : imported.pose_files) outcome.poses.push_back(digest_of(pose));
  if (!imported.read.ok) return fail(outcome, kUnreadableInput, imported.refused, imported.read.error);
  for (const std::string& file : imported.read.files) {
    std::error_code missing;  // then nothing can be overwritten
    if (fs::equivalent(path_of(file), options.output, missing))
      return fail(outcome, kUsage, options.output, "is read too; it would be overwritten");
  }
  PolygonMesh& polygons = imported.read.mesh;
  outcome.reader = polygons.reader;
  outcome.single_precision = polygons.single_precision;
  outcome.remarks = polygons.remarks;
  outcome.parts = polygons.parts.size();

  // Threads begin here: import may fork, and must be alone.
  const parallel::ThreadLimit limit(options.threads);

  progress.step("clean");
  const StoredMesh mesh = prepare(polygons, outcome);
  if (mesh.triangles.empty())
    return fail(outcome, kNoTriangle, options.input, why_no_triangle(outcome, polygons.left_out));
  const std::string amiss = options.strict ? all_defects(outcome) : "";
  if (!amiss.empty()) return fail(outcome, kUnreadableInput, options.input, amiss + " (--strict)");

  if (const std::string defect = level_errors_defect(options, mesh); !defect.empty())
    return fail(outcome, kUsage, options.input, defect);

  progress.step("build");
  const Image image = build_image(options, imported, mesh, progress, outcome);

  progress.step("write");
  stopwatch.lap();
  const std::string error = write_whole_file(options.output, {image.data(), image.size()});
  outcome.seconds.write = stopwatch.lap();
  if (!error.empty()) return fail(outcome, kUnwritableOutput, options.output, error);
  return outcome;
}

}  // namespace tandem::build
