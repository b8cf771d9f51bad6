#include <fcntl.h>
#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <cstring>
#include <exception>
#include <new>

#include "common/printable.h"
#include "pipeline.h"
#include "report.h"

namespace {

using namespace tandem;
using namespace tandem::build;

Outcome run_or_explain(const Options& options) {
  Outcome outcome;
  try {
    return run_pipeline(options);
  } catch (const std::bad_alloc&) {
    outcome.error = options.input.string() + ": not enough memory";
  } catch (const std::exception& defect) {
    outcome.error = options.input.string() + ": internal error: " + defect.what();
  }
  outcome.exit_code = kInternal;
  return outcome;
}

Outcome run(const Options& options) {
  Outcome outcome = run_or_explain(options);
  outcome.error = printable(outcome.error);  // names of files may hold anything
  return outcome;
}

// A file opened while a standard descriptor is closed would take its number, and messages would be written
// into it.
void occupy_standard_descriptors() {
  int descriptor = 0;
  do {
    descriptor = ::open("/dev/null", O_RDWR);
  } while (descriptor >= 0 && descriptor <= STDERR_FILENO);
  if (descriptor > STDERR_FILENO) ::close(descriptor);
}

ExitCode complain(const std::string& what, ExitCode code) {
  std::fprintf(stderr, "bvhbuild: %s\n", what.c_str());
  return code;
}

void print(const Options& options, const Outcome& outcome) {
  if (outcome.exit_code != kDone) complain(outcome.error, outcome.exit_code);
  if (!options.json && (options.quiet || outcome.exit_code != kDone)) return;
  std::fputs(report_of(options, outcome).words(options.json).c_str(), stdout);
}

}  // namespace

int main(int argc, char** argv) {
  occupy_standard_descriptors();
  ExitCode exit_code = kDone;
  const auto options = parse_options(argc, argv, exit_code);
  if (!options) return exit_code;
  const Outcome outcome = run(*options);
  print(*options, outcome);
  if (std::fflush(stdout) == 0) return outcome.exit_code;
  const std::string reason = std::strerror(errno);
  if (outcome.exit_code != kDone)
    return complain("the report could not be printed: " + reason, outcome.exit_code);
  const std::string output = printable(options->output.string());
  return complain(output + " is complete, but the report could not be printed: " + reason, kUnwritableOutput);
}
