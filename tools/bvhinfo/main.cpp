#include <CLI/CLI.hpp>
#include <cstdio>
#include <exception>
#include <string>
#include <utility>
#include <vector>

#include "common/exit_code.h"
#include "common/number_words.h"
#include "common/option_helpers.h"
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

Json verdict(const Inspection& inspection) {
  const bool sound = inspection.is_sound();
  const auto [status, where] = defect(inspection);
  Json json = {{"file", inspection.path},
               {"sound", sound},
               {"status", status},
               {"where", where},
               {"error", sound ? Json() : Json(defect_of(inspection))},
               {"bytes", sound ? Json(inspection.asset.bytes()) : Json()},
               {"check_seconds", inspection.check_seconds}};
  if (!inspection.level_checks) return json;
  json["levels"] = Json::array();
  for (const LevelCheck& check : *inspection.level_checks) json["levels"].push_back(to_json(check));
  json["levels_seconds"] = inspection.level_check_seconds;
  return json;
}

void print_verdict(const Inspection& inspection) {
  if (!inspection.is_sound()) return;
  const double seconds = inspection.check_seconds;
  std::printf("%s: sound (%s checked in %.1f ms, %.2f GB/s)\n", printable(inspection.path).c_str(),
              human_bytes(inspection.asset.bytes()).c_str(), 1e3 * seconds,
              static_cast<double>(inspection.asset.bytes()) / seconds / 1e9);
  if (!inspection.level_checks) return;
  for (const LevelCheck& check : *inspection.level_checks) std::printf("  %s\n", line_of(check).c_str());
}

/// The page of a sound file; two or more side by side. Files that are not sound are left out.
void print_sound(std::vector<Inspection> inspections) {
  std::erase_if(inspections, [](const Inspection& inspection) { return inspection.status != Status::kOk; });
  if (inspections.empty()) return;
  std::fputs((inspections.size() > 1 ? comparison(inspections) : page(inspections[0])).c_str(), stdout);
}

void print(const Options& options, std::vector<Inspection> inspections) {
  if (options.json) {
    Json output = Json::array();
    for (const Inspection& inspection : inspections) {
      const bool whole = inspection.status == Status::kOk && !options.verify;
      output.push_back(whole ? to_json(inspection) : verdict(inspection));
    }
    std::puts(pretty(inspections.size() == 1 ? output[0] : output).c_str());
  } else if (options.verify) {
    for (const Inspection& inspection : inspections) print_verdict(inspection);
  } else {
    print_sound(std::move(inspections));
  }
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
  CLI::App app("Shows what is in a Tandem .bvh file. Two or more files are set side by side.", "bvhinfo");
  Options options;
  app.add_option("FILE", options.files, ".bvh files")->required();
  app.add_flag("--json", options.json, "print JSON: an object for one file, an array for several");
  CLI::Option* verify =
      app.add_flag("--verify", options.verify, "only check the files and say whether they are sound");
  app.add_flag("--levels", options.levels, "prove the error bounds of levels of detail anew")->needs(verify);
  app.set_version_flag("--version", "bvhinfo " TANDEM_VERSION);
  app.footer(
      "Every file is checked in full before anything else is read.\nExit codes: 0 all sound, 1 usage, 2 a "
      "file is not, 4 the output could not be written, 5 internal error.");
  ExitCode exit_code = kDone;
  if (!parse_command_line(app, argc, argv, exit_code)) return exit_code;
  try {
    return run(options);
  } catch (const std::exception& defect) {
    std::fprintf(stderr, "bvhinfo: internal error: %s\n", defect.what());
    return kInternal;
  }
}
