#include "report.h"

#include <sys/resource.h>

#include <cstdio>
#include <sstream>

#include "bvhbuild/levels/self_contacts.h"
#include "common/json.h"
#include "common/number_words.h"
#include "common/printable.h"
#include "statistics/statistics_json.h"

namespace tandem::build {
namespace {

std::uint64_t peak_memory_bytes() {
  struct rusage usage {};
  ::getrusage(RUSAGE_SELF, &usage);
  return static_cast<std::uint64_t>(usage.ru_maxrss) * 1024;
}

std::string number(const char* format, double value) {
  char text[64];
  std::snprintf(text, sizeof text, format, value);
  return text;
}

std::string rounding_line(const Outcome& outcome) {
  std::string line;
  if (outcome.rounding_error == 0) {
    line = "coordinates stored exactly";
  } else {
    line = "coordinates rounded to float32 by at most " + number("%.2g", outcome.rounding_error);
  }
  const double* o = outcome.origin;
  if (o[0] != 0 || o[1] != 0 || o[2] != 0) {
    line += " around the origin (" + number("%.10g", o[0]) + ", " + number("%.10g", o[1]) + ", " +
            number("%.10g", o[2]) + ")";
  }
  if (outcome.single_precision) line += "; the reader keeps float32 only";
  return line;
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
                      {"closed", level.closed ? Json(*level.closed) : Json()},
                      {"self_contacts", level.self_contacts ? Json(*level.self_contacts) : Json()},
                      {"tree", to_json(level.tree)}});
  }
  return levels;
}

void add_results(const Outcome& outcome, Json& json) {
  json["parts"] = outcome.parts;
  json["origin"] = outcome.origin;
  json["rounding_error"] = outcome.rounding_error;
  json["interrupted"] = outcome.interrupted;
  json["tree"] = to_json(outcome.tree);
  json["gpu_blocks"] = outcome.gpu_blocks;
  json["topology"] = outcome.topology;
  if (!outcome.levels.empty()) {
    json["levels"] = levels_json(outcome);
    json["levels_left_out"] = Json::array();
    for (const LevelLeftOut& error : outcome.levels_left_out)
      json["levels_left_out"].push_back(name(error.wanted));
    json["fixed_vertices"] = outcome.fixed_vertices;
  }
  json["bytes"] = outcome.file_bytes;
  json["hash"] = outcome.hash;
}

// "  level 1  4,208 triangles (14.4 %), off by 0.0021 at most (0.1 %), closed", and what else is to be told.
std::string level_line(const Outcome& outcome, std::size_t i) {
  const LevelOutcome& level = outcome.levels[i];
  const auto of_finest = [&](std::uint64_t count) {
    return 100 * static_cast<double>(count) / static_cast<double>(outcome.levels[0].tree.triangles);
  };
  std::ostringstream out;
  out << "  level " << i << "  " << with_commas(level.tree.triangles) << " triangles";
  if (i > 0) {
    out << " (" << number("%.3g", of_finest(level.tree.triangles)) << " %), off by at most "
        << number("%.3g", level.error_bound) << " (" << number("%.3g", 100 * level.error_bound_relative)
        << " % of the diagonal)";
  }
  if (level.closed) out << (*level.closed ? ", closed" : ", not closed");
  if (!level.self_contacts)
    out << ", meets itself at more than " << with_commas(kMostSelfContacts) << " pairs of triangles";
  else if (*level.self_contacts > 0)
    out << ", meets itself at " << with_commas(*level.self_contacts)
        << (*level.self_contacts == 1 ? " pair of triangles" : " pairs of triangles");
  return out.str() + "\n";
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

void print_levels(const Outcome& outcome, std::ostringstream& out) {
  for (std::size_t i = 0; i < outcome.levels.size(); ++i) out << level_line(outcome, i);
  for (const LevelLeftOut& error : outcome.levels_left_out)
    out << "  note     no level for " << name(error.wanted) << ": " << why(error.why) << "\n";
  if (outcome.fixed_vertices > 0) {
    out << "  note     " << with_commas(outcome.fixed_vertices)
        << (outcome.fixed_vertices == 1 ? " vertex where surfaces meet stays"
                                        : " vertices where surfaces meet stay")
        << " in place at every level\n";
  }
}

}  // namespace

std::string text_report(const Options& options, const Outcome& outcome) {
  const TreeStatistics& tree = outcome.tree;
  const std::uint64_t blocks = tree.leaf_blocks + tree.internal_blocks;
  std::ostringstream out;
  out << printable(options.output.string()) << ": " << with_commas(tree.triangles)
      << (tree.triangles == 1 ? " triangle" : " triangles") << " in " << with_commas(blocks)
      << (blocks == 1 ? " block, " : " blocks, ") << human_bytes(outcome.file_bytes) << "\n";
  out << "  read     " << with_commas(outcome.clean.faces) << " faces, "
      << with_commas(outcome.clean.vertices) << " vertices from "
      << printable(options.input.filename().string()) << " (" << outcome.reader << ")\n";
  for (const std::string& remark : outcome.remarks) out << "  note     " << remark << "\n";
  for (const Finding& finding : findings(outcome.clean)) {
    if (finding.count > 0) out << "  found    " << finding.sentence() << "\n";
  }
  out << "  stored   " << rounding_line(outcome) << "\n";
  out << "  tree     " << tree.imaginary_nodes << " of " << with_commas(tree.nodes)
      << " nodes imaginary (minimum " << tree.imaginary_minimum << "), depth " << tree.depth << ", SAH cost "
      << number("%.2f", tree.sah_cost) << "\n";
  print_levels(outcome, out);
  if (!outcome.gpu_blocks) out << "  note     no oriented blocks: exact queries on a GPU refuse the file\n";
  if (!outcome.topology) out << "  note     no topology: contact manifolds refuse the file\n";
  if (outcome.interrupted) out << "  note     interrupted: this is the best tree until then\n";
  const Outcome::Seconds& s = outcome.seconds;
  out << "  took     import " << number("%.2f", s.import) << " s, clean " << number("%.2f", s.clean)
      << " s, build " << number("%.2f", s.build) << " s"
      << (options.levels.empty() ? "" : " (levels " + number("%.2f", s.levels) + " s)") << ", write "
      << number("%.2f", s.write) << " s; peak memory " << human_bytes(peak_memory_bytes()) << "\n";
  return out.str();
}

std::string json_report(const Options& options, const Outcome& outcome) {
  Json json = {{"tool", "bvhbuild"},
               {"version", TANDEM_VERSION},
               {"exit_code", static_cast<int>(outcome.exit_code)},
               {"error", outcome.error.empty() ? Json() : Json(outcome.error)},
               {"input", options.input.string()},
               {"output", options.output.string()},
               {"reader", outcome.reader},
               {"single_precision_reader", outcome.single_precision},
               {"faces", outcome.clean.faces},
               {"vertices", outcome.clean.vertices},
               {"remarks", outcome.remarks},
               {"findings", findings_json(outcome.clean)}};
  if (outcome.exit_code == kDone) add_results(outcome, json);
  const Outcome::Seconds& s = outcome.seconds;
  json["seconds"] = {{"import", s.import}, {"clean", s.clean}, {"build", s.build}, {"write", s.write}};
  if (!options.levels.empty()) json["seconds"]["levels"] = s.levels;
  json["peak_memory_bytes"] = peak_memory_bytes();
  return pretty(json) + "\n";
}

}  // namespace tandem::build
