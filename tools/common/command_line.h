#pragma once
#include <algorithm>
#include <filesystem>
#include <functional>
#include <initializer_list>
#include <map>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

#include "exit_code.h"

namespace CLI {
class App;
class Option;
}  // namespace CLI

/// The command lines of the tools share this. CLI11 parses them; it is known to command_line.cpp alone, for
/// it takes ten seconds to compile wherever it is included.
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

/// Returns what is wrong with the text that an option was given, or nothing.
using Check = std::function<std::string(const std::string&)>;

/// Refuses what is no number from lower to upper.
Check between(double lower, double upper);

/// Refuses an empty name, and "-", which many programs take for standard input or output and these do not.
Check file_name();

/// Refuses what is none of these words.
Check one_of(std::vector<std::string> words);

/// Returns the number that a text is as a whole; none if it is not one.
std::optional<double> number_in(const std::string& text);

/// An option of a command line, or one of its arguments: a row of its table of options.
class OptionRow {
 public:
  /// name: such as "SCENE", "--repeat" or "-o,--output". values: what the help says of the value, such as
  /// "N [1]"; empty: its type. The value must outlive the command line. T: text, a number, an optional
  /// number, or several of them (command_line.cpp lists the types).
  template <typename T>
  OptionRow(const char* name, T& value, std::string values, std::string help, Check check = {});

  /// An option whose values are the names and nothing else. The names must outlive the command line.
  template <typename T>
  OptionRow(const char* name, T& chosen, const std::map<std::string, T>& names, std::string values,
            std::string help)
      : OptionRow(
            name, [&names, &chosen](const std::string& word) { chosen = names.at(word); }, std::move(values),
            std::move(help), one_of(words_of(names))) {}

  /// The path of a file.
  OptionRow(const char* name, std::filesystem::path& path, std::string values, std::string help,
            Check check = {});

  /// An option that `take` is given the text of.
  OptionRow(const char* name, std::function<void(const std::string&)> take, std::string values,
            std::string help, Check check = {});

  /// An option without a value.
  OptionRow(const char* name, bool& given, std::string help);

  /// An option without a value that makes something false.
  struct Cleared {
    bool& value;
  };
  OptionRow(const char* name, Cleared cleared, std::string help);

  /// The row of an option that must be given.
  friend OptionRow required(OptionRow row);

  /// The row of an option whose values may be separated by commas.
  friend OptionRow separated_by_commas(OptionRow row);

  /// The row of an option whose value is a number of bytes, such as 1000 or 4GiB.
  friend OptionRow in_bytes(OptionRow row);

 private:
  friend class Command;

  template <typename T>
  static std::vector<std::string> words_of(const std::map<std::string, T>& names) {
    std::vector<std::string> words;
    for (const auto& [word, value] : names) words.push_back(word);
    return words;
  }

  std::function<CLI::Option*(CLI::App&)> add_;
  std::string values_;
  Check check_;
  bool required_ = false, separated_by_commas_ = false, in_bytes_ = false;
};

OptionRow required(OptionRow row);
OptionRow separated_by_commas(OptionRow row);
OptionRow in_bytes(OptionRow row);

/// A command of a tool, or the tool itself: what its command line may hold. A handle.
class Command {
 public:
  /// Adds a command of this one. `chosen` is called where the command line has it, after its values are
  /// filled.
  Command add_command(const char* name, const char* help, std::function<void()> chosen = {}) const;

  /// One of the commands of this one must be given.
  void require_command() const;

  /// Adds a group of options of which exactly one must be given.
  Command add_choice(const char* name) const;

  /// Adds these options, in the order of the help.
  void add(std::initializer_list<OptionRow> rows) const;

  // These say what else holds of an option that was added.
  void check(const char* option, const Check& check) const;
  void take_values(const char* option, int count) const;
  void exclude(const char* option, const char* other) const;
  void need(const char* option, const char* other) const;

  /// Sets the text at the end of the help.
  void end_help(const std::string& text) const;

 protected:
  explicit Command(CLI::App* app) : app_(app) {}
  CLI::App* app_;
};

/// The command line of a tool.
class Tool : public Command {
 public:
  /// version: what --version prints.
  /// Effect: prepare_process().
  Tool(const char* name, const char* help, const char* version);
  ~Tool();
  Tool(const Tool&) = delete;
  Tool& operator=(const Tool&) = delete;

  /// Parses the command line.
  ///
  /// Effect: fills what the options are bound to. Prints the help or the version where they are asked for, or
  /// what is wrong: arguments that nobody expects come first, in their order.
  /// Result: whether there is something to run; if not, `exit_code` is what the tool returns.
  bool parse(int argc, char** argv, ExitCode& exit_code) const;
};

/// Throws UsageError where writing `output` would overwrite one of the inputs.
void keep_inputs(const std::string& output, const std::vector<std::string>& inputs);

}  // namespace tandem
