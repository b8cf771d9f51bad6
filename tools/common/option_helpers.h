#pragma once
#include <CLI/CLI.hpp>
#include <map>
#include <stdexcept>
#include <string>
#include <vector>

#include "exit_code.h"

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

/// Refuses an empty name, and "-", which many programs take for standard input or output and these do not.
CLI::Validator file_name();

/// Parses the command line of a tool.
///
/// Effect: fills what the options of `app` are bound to. Prints the help or the version where they are asked
/// for, or what is wrong: arguments that nobody expects come first, in their order.
/// Result: whether there is something to run; if not, `exit_code` is what the tool returns.
bool parse_command_line(CLI::App& app, int argc, char** argv, ExitCode& exit_code);

/// Throws UsageError where writing `output` would overwrite one of the inputs.
void keep_inputs(const std::string& output, const std::vector<std::string>& inputs);

}  // namespace tandem
