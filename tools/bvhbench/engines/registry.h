#pragma once
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "engine.h"

namespace tandem {

/// The engines that a simulator can use, built in or not: tandem, tandem-cuda, paper, paper-bits, fcl,
/// embree, embree-refit.
std::vector<std::string_view> engine_names();

/// The engines whose shapes can be deformed, of those built in; "tandem" is the first, and then
/// "tandem-cuda".
std::vector<std::string_view> deforming_engine_names();

/// Returns whether this program has the engine.
bool is_built_in(std::string_view name);

/// Makes an engine that answers the question. Throws std::runtime_error: no engine of this name, one that is
/// not built in, without a usable GPU, that does not answer this question, or that has no such mode.
std::unique_ptr<Engine> make_engine(std::string_view name, const Question& question = ContactOptions());

/// The libraries whose contacts `bvhbench compare` compares, of those built in, in the order of the charts.
std::vector<std::string_view> peer_names();

/// The engines that `bvhbench compare` asks the question of, in the order of the charts, with these options;
/// for contacts one for each mode worth comparing. libraries: of peer_names(); none: all.
std::vector<std::unique_ptr<Engine>> make_peers(const Question& question,
                                                const std::vector<std::string>& libraries = {});

}  // namespace tandem
