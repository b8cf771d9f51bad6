#pragma once
#include <CLI/CLI.hpp>
#include <algorithm>
#include <functional>
#include <initializer_list>
#include <map>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

#include "exit_code.h"

/// The command lines of the tools share this.
namespace tandem {

/// Something wrong with the command line that shows only once a file is read.
struct UsageError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// The name of a value. Condition: it has one.
template <typename T>
const std::string& name_of(const T& value, const std::map<std::string, T>& names) {
  return std::find_if(names.begin(), names.end(), [&](const auto& name) { return name.second == value; })
      ->first;
}

/// An option of a command line, or one of its arguments: a row of its table of options.
class OptionRow {
 public:
  /// name: such as "SCENE", "--repeat" or "-o,--output". values: what the help says of the value, such as
  /// "N [1]"; empty: its type. The value must outlive the command line.
  template <typename T>
  OptionRow(const char* name, T& value, std::string values, std::string help,
            std::optional<CLI::Validator> check = {})
      : values_(std::move(values)), check_(std::move(check)) {
    add_ = [=, &value](CLI::App& app) { return app.add_option(name, value, help); };
  }

  /// An option whose values are the names and nothing else: CLI::Transformer would take an enumeration's
  /// numbers too. The names must outlive the command line.
  template <typename T>
  OptionRow(const char* name, T& chosen, const std::map<std::string, T>& names, std::string values,
            std::string help)
      : values_(std::move(values)), check_(CLI::IsMember(&names)) {
    const auto choose = [&names, &chosen](const std::string& word) { chosen = names.at(word); };
    add_ = [=](CLI::App& app) { return app.add_option_function<std::string>(name, choose, help); };
  }

  /// An option that `take` is given the text of.
  OptionRow(const char* name, std::function<void(const std::string&)> take, std::string values,
            std::string help, std::optional<CLI::Validator> check = {})
      : values_(std::move(values)), check_(std::move(check)) {
    add_ = [=](CLI::App& app) { return app.add_option_function<std::string>(name, take, help); };
  }

  /// An option without a value.
  OptionRow(const char* name, bool& given, std::string help) {
    add_ = [=, &given](CLI::App& app) { return app.add_flag(name, given, help); };
  }

  /// An option without a value that makes something false.
  struct Cleared {
    bool& value;
  };
  OptionRow(const char* name, Cleared cleared, std::string help) {
    const auto clear = [&value = cleared.value] { value = false; };
    add_ = [=](CLI::App& app) { return app.add_flag_callback(name, clear, help); };
  }

  friend OptionRow required(OptionRow row);
  friend void add_options(CLI::App& app, std::initializer_list<OptionRow> rows);

 private:
  std::function<CLI::Option*(CLI::App&)> add_;
  std::string values_;
  std::optional<CLI::Validator> check_;
  bool required_ = false;
};

/// The row of an option that must be given.
OptionRow required(OptionRow row);

/// Gives a command these options, in the order of its help.
void add_options(CLI::App& app, std::initializer_list<OptionRow> rows);

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
