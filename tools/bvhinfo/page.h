#pragma once
#include <string>
#include <vector>

#include "inspect.h"

namespace tandem {

/// The readable page of one file. Condition: the inspection is complete.
std::string page(const Inspection& inspection);

/// Two or more files side by side, each figure with its ratio to the first file's.
std::string comparison(const std::vector<Inspection>& inspections);

/// The JSON object of one file. Keys in docs/json.md.
Json to_json(const Inspection& inspection);

}  // namespace tandem
