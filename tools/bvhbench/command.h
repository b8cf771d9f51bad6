#pragma once
#include <CLI/CLI.hpp>
#include <functional>
#include <map>
#include <stdexcept>
#include <string>
#include <vector>

#include "exit_code.h"

/// What the subcommands of bvhbench share.
namespace tandem::bench {

/// What a parsed command line asks for; main() runs it. Throws UsageError, FileError, OutputError.
using Run = std::function<ExitCode()>;

/// Something wrong with the command line that shows only once a file is read.
struct UsageError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// An option whose values are the names and nothing else.
template <typename T>
CLI::Option* add_choice(CLI::App& app, const char* flag, const std::map<std::string, T>& names, T& chosen,
                        const char* help) {
  const auto choose = [&names, &chosen](const std::string& word) { chosen = names.at(word); };
  return app.add_option_function<std::string>(flag, choose, help)->check(CLI::IsMember(&names));
}

/// Refuses what is no number from lower to upper, NaN included.
CLI::Validator between(double lower, double upper);

/// Throws UsageError where writing `output` would overwrite one of the inputs.
void keep_inputs(const std::string& output, const std::vector<std::string>& inputs);

/// Refuses what is no cube of a whole number.
CLI::Validator cube_of_a_whole_number();

/// Refuses an empty name.
CLI::Validator file_name();

}  // namespace tandem::bench
