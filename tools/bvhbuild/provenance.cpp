#include "provenance.h"

#include "common/json.h"
#include "common/number_words.h"

namespace tandem::build {

std::string provenance_json(const Options& options, const Outcome& outcome) {
  Json found = Json::object();
  for (const Finding& finding : findings(outcome.clean)) {
    if (finding.count > 0) found[finding.key] = finding.count;
  }
  Json shaping = {{"imaginary", name(options.imaginary)}, {"effort", name(options.effort)}};
  if (!options.gpu_blocks) shaping["gpu_blocks"] = false;
  if (!options.topology) shaping["topology"] = false;
  if (!options.levels.empty()) {
    shaping["levels"] = Json::array();
    for (const LevelError& error : options.levels) shaping["levels"].push_back(name(error));
  }
  if (outcome.interrupted) shaping["interrupted"] = true;
  const Json json = {{"tool", "bvhbuild"},
                     {"version", TANDEM_VERSION},
                     {"input",
                      {{"file", options.input.filename().string()},
                       {"bytes", outcome.input.bytes},
                       {"xxh64", hexadecimal(outcome.input.hash)},
                       {"reader", outcome.reader},
                       {"faces", outcome.clean.faces},
                       {"vertices", outcome.clean.vertices}}},
                     {"options", shaping},
                     {"findings", found}};
  return json.dump(-1, ' ', false, Json::error_handler_t::replace);
}

}  // namespace tandem::build
