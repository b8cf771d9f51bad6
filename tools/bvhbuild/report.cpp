#include "report.h"

#include "common/number_words.h"
#include "common/path_text.h"
#include "common/printable.h"
#include "common/process.h"
#include "statistics/statistics_json.h"

namespace tandem::build {
namespace {

std::string rounding_words(const Outcome& outcome) {
  std::string words = outcome.rounding_error == 0
                          ? "coordinates stored exactly"
                          : format("coordinates rounded to float32 by at most %.2g", outcome.rounding_error);
  const double* o = outcome.origin;
  if (o[0] != 0 || o[1] != 0 || o[2] != 0)
    words += format(" around the origin (%.10g, %.10g, %.10g)", o[0], o[1], o[2]);
  if (outcome.single_precision) words += "; the reader keeps float32 only";
  return words;
}

// "1 triangle", "5,804 triangles".
std::string number_of(std::uint64_t count, const char* one, const char* several) {
  return with_commas(count) + " " + (count == 1 ? one : several);
}

Json findings_json(const CleanReport& report) {
  Json json = Json::object();
  for (const Finding& finding : findings(report)) json[finding.key] = finding.count;
  return json;
}

Json levels_json(const Outcome& outcome) {
  Json levels = Json::array();
  for (const LevelOutcome& level : outcome.levels) {
    levels.push_back({{"wanted", level.wanted ? Json(name(*level.wanted)) : Json()},
                      {"triangles", level.tree.triangles},
                      {"error_bound", level.error_bound},
                      {"error_bound_relative", level.error_bound_relative},
                      {"closed", or_null(level.closed)},
                      {"self_contacts", or_null(level.self_contacts)},
                      {"tree", to_json(level.tree)}});
  }
  return levels;
}

// Adds what there is where the build succeeded.
void add_results(const Outcome& outcome, Report& report) {
  report.add({{"parts", outcome.parts},
              {"origin", outcome.origin},
              {"rounding_error", outcome.rounding_error},
              {"interrupted", outcome.interrupted},
              {"tree", to_json(outcome.tree)},
              {"gpu_blocks", outcome.gpu_blocks},
              {"topology", outcome.topology},
              {"refit", outcome.refit}});
  if (!outcome.levels.empty()) {
    Json left_out = Json::array();
    for (const LevelLeftOut& error : outcome.levels_left_out) left_out.push_back(name(error.wanted));
    report.add({{"levels", levels_json(outcome)},
                {"levels_left_out", std::move(left_out)},
                {"fixed_vertices", outcome.fixed_vertices}});
  }
  if (!outcome.samples.empty()) report.add("samples", samples_json(outcome.samples));
  report.add("bytes", outcome.file_bytes);
  report.add("hash", outcome.hash);
}

// "4,208 triangles (14.4 %), off by at most 0.0021 (0.1 % of the diagonal), closed", and what else is to be
// told.
std::string level_words(const Outcome& outcome, std::size_t i) {
  const LevelOutcome& level = outcome.levels[i];
  const auto count = static_cast<double>(level.tree.triangles);
  std::string words = with_commas(level.tree.triangles) + " triangles";
  if (i > 0) {
    words += format(" (%.3g %%), off by at most %.3g (%.3g %% of the diagonal)",
                    100 * count / static_cast<double>(outcome.levels[0].tree.triangles), level.error_bound,
                    100 * level.error_bound_relative);
  }
  if (level.closed) words += *level.closed ? ", closed" : ", not closed";
  if (!level.self_contacts) return words + ", meets itself too often to be counted";
  if (*level.self_contacts == 0) return words;
  return words + ", meets itself at " +
         number_of(*level.self_contacts, "pair of triangles", "pairs of triangles");
}

const char* why(NoLevel reason) {
  switch (reason) {
    case NoLevel::no_coarser:
      return "it would have as many triangles as the one before";
    case NoLevel::spared:
      return "a later one is coarser and nearer";
    case NoLevel::interrupted:
      return "its making was interrupted";
  }
  return "unknown";
}

void add_level_rows(const Outcome& outcome, Report& report) {
  for (std::size_t i = 0; i < outcome.levels.size(); ++i)
    report.row(format("level %zu", i).c_str(), level_words(outcome, i));
  for (const LevelLeftOut& error : outcome.levels_left_out)
    report.row("note", "no level for " + name(error.wanted) + ": " + why(error.why));
  if (outcome.fixed_vertices > 0) {
    report.row("note", number_of(outcome.fixed_vertices, "vertex where surfaces meet stays",
                                 "vertices where surfaces meet stay") +
                           " in place at every level");
  }
}

std::string seconds_words(const Options& options, const Outcome::Seconds& s) {
  return format("import %.2f s, clean %.2f s, build %.2f s", s.import, s.clean, s.build) +
         (s.samples > 0 ? format(" (measuring samples %.2f s)", s.samples) : "") +
         (options.levels.empty() ? "" : format(" (levels %.2f s)", s.levels)) +
         format(", write %.2f s; peak memory %s", s.write, human_bytes(peak_memory_bytes()).c_str());
}

void add_text(const Options& options, const Outcome& outcome, Report& report) {
  const TreeStatistics& tree = outcome.tree;
  report.line(printable(text_of(options.output)) + ": " + number_of(tree.triangles, "triangle", "triangles") +
              " in " + number_of(tree.leaf_blocks + tree.internal_blocks, "block", "blocks") + ", " +
              human_bytes(outcome.file_bytes));
  report.row("read", with_commas(outcome.clean.faces) + " faces, " + with_commas(outcome.clean.vertices) +
                         " vertices from " + printable(text_of(options.input.filename())) + " (" +
                         outcome.reader + ")");
  for (const std::string& remark : outcome.remarks) report.row("note", remark);
  for (const Finding& finding : findings(outcome.clean)) {
    if (finding.count > 0) report.row("found", finding.sentence());
  }
  report.row("stored", rounding_words(outcome));
  report.row("tree", std::to_string(tree.imaginary_nodes) + " of " + with_commas(tree.nodes) +
                         " nodes imaginary (minimum " + std::to_string(tree.imaginary_minimum) +
                         format("), depth %u, SAH cost %.2f", tree.depth, tree.sah_cost));
  add_level_rows(outcome, report);
  if (!outcome.samples.empty()) report.row("samples", samples_words(samples_json(outcome.samples)));
  if (!outcome.gpu_blocks) report.row("note", "no oriented blocks: exact queries on a GPU refuse the file");
  if (!outcome.topology) report.row("note", "no topology: contact manifolds refuse the file");
  if (!outcome.refit) report.row("note", "no source vertices: the tree cannot be refitted to a bent mesh");
  if (outcome.interrupted) report.row("note", "interrupted: this is the best tree until then");
  report.row("took", seconds_words(options, outcome.seconds));
}

}  // namespace

Report report_of(const Options& options, const Outcome& outcome) {
  Report report(8, 0);
  report.add({{"tool", "bvhbuild"},
              {"version", TANDEM_VERSION},
              {"exit_code", static_cast<int>(outcome.exit_code)},
              {"error", or_null(outcome.error)},
              {"input", text_of(options.input)},
              {"output", text_of(options.output)},
              {"reader", outcome.reader},
              {"single_precision_reader", outcome.single_precision},
              {"faces", outcome.clean.faces},
              {"vertices", outcome.clean.vertices},
              {"remarks", outcome.remarks},
              {"findings", findings_json(outcome.clean)}});
  if (outcome.exit_code == kDone) {
    add_results(outcome, report);
    add_text(options, outcome, report);
  }
  const Outcome::Seconds& s = outcome.seconds;
  report.add({{"seconds/import", s.import},
              {"seconds/clean", s.clean},
              {"seconds/build", s.build},
              {"seconds/write", s.write}});
  if (!options.levels.empty()) report.add("seconds/levels", s.levels);
  if (!outcome.samples.empty()) report.add("seconds/samples", s.samples);
  report.add("peak_memory_bytes", peak_memory_bytes());
  return report;
}

}  // namespace tandem::build
