#pragma once
#include <string>
#include <vector>

#include "common/report.h"
#include "inspect.h"

namespace tandem {

/// Makes the report of one file: its text is a page for people, its JSON has the keys of docs/json.md.
/// Condition: the inspection is complete.
Report report_of(const Inspection& inspection);

/// Two or more files side by side, each figure with its ratio to the first file's.
std::string comparison(const std::vector<Inspection>& inspections);

}  // namespace tandem
