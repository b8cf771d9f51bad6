#include <cstdio>
#include <exception>
#include <string>
#include <utility>
#include <vector>

#include "common/command_line.h"
#include "common/exit_code.h"
#include "common/number_words.h"
#include "common/printable.h"
#include "page.h"

namespace {

using namespace tandem;

struct Options {
  std::vector<std::string> files;
  bool json = false;
  bool verify = false;
  bool levels = false;

  InspectionDepth depth() const {
    if (!verify) return InspectionDepth::everything;
    return levels ? InspectionDepth::verify_levels : InspectionDepth::verify;
  }
};

/// The name of the defect and the number of what has it.
std::pair<const char*, Json> defect(const Inspection& inspection) {
  if (inspection.wrong_level() != nullptr)
    return {name(inspection.wrong_level()->verdict), inspection.wrong_level()->level};
  const bool has_number = subject(inspection.status) != nullptr;
  return {name(inspection.status), has_number ? Json(inspection.asset.where()) : Json()};
}

Report verdict_of(const Inspection& inspection) {
  const bool sound = inspection.is_sound();
  const auto [status, where] = defect(inspection);
  const double seconds = inspection.check_seconds;
  const auto bytes = static_cast<double>(inspection.asset.bytes());
  Report report;
  if (sound) {
    report.line(format("%s: sound (%s checked in %.1f ms, %.2f GB/s)", printable(inspection.path).c_str(),
                       human_bytes(inspection.asset.bytes()).c_str(), 1e3 * seconds, bytes / seconds / 1e9));
  }
  report.add({{"file", inspection.path},
              {"sound", sound},
              {"status", status},
              {"where", where},
              {"error", sound ? Json() : Json(defect_of(inspection))},
              {"bytes", sound ? Json(inspection.asset.bytes()) : Json()},
              {"check_seconds", seconds}});
  if (!inspection.level_checks) return report;
  Json levels = Json::array();
  for (const LevelCheck& check : *inspection.level_checks) {
    levels.push_back(to_json(check));
    if (sound) report.line("  " + line_of(check));
  }
  report.add("levels", std::move(levels));
  report.add("levels_seconds", inspection.level_check_seconds);
  return report;
}

/// The page of a sound file; two or more side by side. Files that are not sound are left out.
void print_sound(std::vector<Inspection> inspections) {
  std::erase_if(inspections, [](const Inspection& inspection) { return inspection.status != Status::kOk; });
  if (inspections.empty()) return;
  std::fputs((inspections.size() > 1 ? comparison(inspections) : report_of(inspections[0]).text()).c_str(),
             stdout);
}

void print(const Options& options, std::vector<Inspection> inspections) {
  if (!options.json && !options.verify) return print_sound(std::move(inspections));
  Json all = Json::array();
  for (const Inspection& inspection : inspections) {
    const bool whole = inspection.status == Status::kOk && !options.verify;
    const Report report = whole ? report_of(inspection) : verdict_of(inspection);
    all.push_back(report.json());
    if (!options.json) std::fputs(report.text().c_str(), stdout);
  }
  if (options.json) std::puts(pretty(all.size() == 1 ? all[0] : all).c_str());
}

ExitCode run(const Options& options) {
  std::vector<Inspection> inspections;
  bool all_sound = true;
  for (const std::string& file : options.files) {
    inspections.push_back(inspect(file, options.depth()));
    if (inspections.back().is_sound()) continue;
    all_sound = false;
    std::fprintf(stderr, "bvhinfo: %s\n", printable(defect_of(inspections.back())).c_str());
  }
  print(options, std::move(inspections));
  if (std::fflush(stdout) != 0) {
    std::perror("bvhinfo: standard output");
    return kUnwritableOutput;
  }
  return all_sound ? kDone : kUnreadableInput;
}

}  // namespace

int main(int argc, char** argv) {
  const Tool tool("bvhinfo", "Shows what is in a Tandem .bvh file. Two or more files are set side by side.",
                  TANDEM_VERSION);
  Options options;
  tool.add({required({"FILE", options.files, "", ".bvh files"}),
            {"--json", options.json, "print JSON: an object for one file, an array for several"},
            {"--verify", options.verify, "only check the files and say whether they are sound"},
            {"--levels", options.levels, "prove the error bounds of levels of detail anew"}});
  tool.need("--levels", "--verify");
  tool.end_help(
      "Every file is checked in full before anything else is read.\nExit codes: 0 all sound, 1 usage, 2 a "
      "file is not, 4 the output could not be written, 5 internal error.");
  ExitCode exit_code = kDone;
  if (!tool.parse(argc, argv, exit_code)) return exit_code;
  try {
    return run(options);
  } catch (const std::exception& defect) {
    std::fprintf(stderr, "bvhinfo: internal error: %s\n", defect.what());
    return kInternal;
  }
}
