#pragma once
#include <CLI/CLI.hpp>
#include <map>
#include <stdexcept>
#include <string>
#include <vector>

/// What the command lines of the tools share.
namespace tandem {

/// Something wrong with the command line that shows only once a file is read.
struct UsageError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// An option whose values are the names and nothing else: CLI::Transformer would take an enumeration's
/// numbers too.
template <typename T>
CLI::Option* add_choice(CLI::App& app, const char* flag, const std::map<std::string, T>& names, T& chosen,
                        const char* help) {
  const auto choose = [&names, &chosen](const std::string& word) { chosen = names.at(word); };
  return app.add_option_function<std::string>(flag, choose, help)->check(CLI::IsMember(&names));
}

/// Refuses what is no number from lower to upper. CLI::Range lets NaN pass.
CLI::Validator between(double lower, double upper);

/// Refuses an empty name.
CLI::Validator file_name();

/// Throws UsageError where writing `output` would overwrite one of the inputs.
void keep_inputs(const std::string& output, const std::vector<std::string>& inputs);

}  // namespace tandem
