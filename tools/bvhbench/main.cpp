#include <CLI/CLI.hpp>
#include <cstdio>
#include <exception>
#include <new>

#include "bvhbench/engines/engine.h"
#include "bvhbench/scenes/hdf5_file.h"
#include "command.h"
#include "common/option_helpers.h"
#include "common/printable.h"

namespace {

using namespace tandem;
using namespace tandem::bench;

constexpr const char* kFooter =
    "Exit codes: 0 done, 1 usage, 2 an input could not be read, 4 the output could not be written,\n"
    "5 internal error, 6 no GPU can be used, or it has too little memory.";

ExitCode fail(ExitCode code, const char* reason) {
  std::fprintf(stderr, "bvhbench: %s\n", printable(reason).c_str());
  return code;
}

ExitCode run_and_report(const Run& run) {
  try {
    const ExitCode code = run();
    if (std::fflush(stdout) == 0) return code;
    std::perror("bvhbench: standard output");
    return kUnwritableOutput;
  } catch (const UsageError& error) {
    return fail(kUsage, error.what());
  } catch (const OutputError& error) {
    return fail(kUnwritableOutput, error.what());
  } catch (const FileError& error) {
    return fail(kUnreadableInput, error.what());
  } catch (const GpuError& error) {
    return fail(kUnusableGpu, error.what());
  } catch (const std::bad_alloc&) {
    return fail(kInternal, "not enough memory");
  } catch (const std::exception& defect) {
    return fail(kInternal, (std::string("internal error: ") + defect.what()).c_str());
  }
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app("Makes scenes of posed meshes, finds their contacts, and lets them move.", "bvhbench");
  app.set_version_flag("--version", "bvhbench " TANDEM_VERSION);
  app.footer(kFooter);
  app.require_subcommand(1);
  Run run;
  add_scene(app, run);
  add_query(app, run);
  add_impact(app, run);
  add_distance(app, run);
  add_compare(app, run);
  add_simulate(app, run);
  add_economy(app, run);
  add_frame(app, run);
  add_poses(app, run);
  ExitCode exit_code = kDone;
  return parse_command_line(app, argc, argv, exit_code) ? run_and_report(run) : exit_code;
}
