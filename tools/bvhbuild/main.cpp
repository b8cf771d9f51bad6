#include <cerrno>
#include <cstdio>
#include <cstring>
#include <exception>
#include <new>

#include "common/path_text.h"
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
    outcome.error = text_of(options.input) + ": not enough memory";
  } catch (const std::exception& defect) {
    outcome.error = text_of(options.input) + ": internal error: " + defect.what();
  }
  outcome.exit_code = kInternal;
  return outcome;
}

Outcome run(const Options& options) {
  Outcome outcome = run_or_explain(options);
  outcome.error = printable(outcome.error);  // names of files may hold anything
  return outcome;
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
  ExitCode exit_code = kDone;
  const auto options = parse_options(argc, argv, exit_code);
  if (!options) return exit_code;
  const Outcome outcome = run(*options);
  print(*options, outcome);
  if (std::fflush(stdout) == 0) return outcome.exit_code;
  const std::string reason = std::strerror(errno);
  if (outcome.exit_code != kDone)
    return complain("the report could not be printed: " + reason, outcome.exit_code);
  const std::string output = printable(text_of(options->output));
  return complain(output + " is complete, but the report could not be printed: " + reason, kUnwritableOutput);
}
