#include <fcntl.h>
#include <unistd.h>

#include <cstdio>
#include <exception>
#include <new>

#include "pipeline.h"
#include "report.h"

namespace {

using namespace tandem;
using namespace tandem::build;

Outcome run(const Options& options) {
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

// A file opened while a standard descriptor is closed would take its number, and messages would be written
// into it.
void occupy_standard_descriptors() {
  int descriptor = 0;
  do {
    descriptor = ::open("/dev/null", O_RDWR);
  } while (descriptor >= 0 && descriptor <= STDERR_FILENO);
  if (descriptor > STDERR_FILENO) ::close(descriptor);
}

void print(const Options& options, const Outcome& outcome) {
  if (outcome.exit_code != kDone) std::fprintf(stderr, "bvhbuild: %s\n", outcome.error.c_str());
  if (options.json) {
    std::fputs(json_report(options, outcome).c_str(), stdout);
  } else if (!options.quiet && outcome.exit_code == kDone) {
    std::fputs(text_report(options, outcome).c_str(), stdout);
  }
}

}  // namespace

int main(int argc, char** argv) {
  occupy_standard_descriptors();
  int exit_code = kDone;
  const auto options = parse_options(argc, argv, exit_code);
  if (!options) return exit_code;
  const Outcome outcome = run(*options);
  print(*options, outcome);
  if (std::fflush(stdout) != 0) {
    std::perror("bvhbuild: standard output");
    return outcome.exit_code != kDone ? outcome.exit_code : kUnwritableOutput;
  }
  return outcome.exit_code;
}
