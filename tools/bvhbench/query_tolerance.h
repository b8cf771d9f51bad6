#pragma once
#include "question.h"

namespace tandem::bench {

/// `bvhbench query --tolerance`: finds what is certain of the pairs of a scene, whose bodies stand for all
/// their levels, writes the file that was asked for, and prints a report.
ExitCode run_tolerance(const CommonArguments& arguments, double tolerance);

}  // namespace tandem::bench
