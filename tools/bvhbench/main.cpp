#include <cstdio>
#include <exception>
#include <new>

#include "bvhbench/engines/engine.h"
#include "bvhbench/scenes/hdf5_file.h"
#include "command.h"
#include "common/command_line.h"
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
  const Tool tool("bvhbench", "Makes scenes of posed meshes, finds their contacts, and lets them move.",
                  TANDEM_VERSION);
  tool.end_help(kFooter);
  tool.require_command();
  Run run;
  add_scene(tool, run);
  add_query(tool, run);
  add_impact(tool, run);
  add_distance(tool, run);
  add_compare(tool, run);
  add_simulate(tool, run);
  add_deform(tool, run);
  add_economy(tool, run);
  add_frame(tool, run);
  add_poses(tool, run);
  add_probe(tool, run);
  ExitCode exit_code = kDone;
  return tool.parse(argc, argv, exit_code) ? run_and_report(run) : exit_code;
}
