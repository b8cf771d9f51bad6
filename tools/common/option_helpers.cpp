#include "option_helpers.h"

#include <cstdio>
#include <filesystem>

#include "printable.h"

namespace tandem {

CLI::Validator between(double lower, double upper) {
  const auto defect = [lower, upper](const std::string& text) {
    double value = 0;
    if (CLI::detail::lexical_cast(text, value) && value >= lower && value <= upper) return std::string();
    return text + " is no number from " + CLI::detail::to_string(lower) + " to " +
           CLI::detail::to_string(upper);
  };
  return CLI::Validator(defect, "");
}

CLI::Validator file_name() {
  const auto defect = [](const std::string& text) -> std::string {
    if (text.empty()) return "a file needs a name";
    return text == "-" ? "- is not standard input or output here; ./- names a file" : "";
  };
  return CLI::Validator(defect, "");
}

OptionRow required(OptionRow row) {
  row.required_ = true;
  return row;
}

void add_options(CLI::App& app, std::initializer_list<OptionRow> rows) {
  for (const OptionRow& row : rows) {
    CLI::Option* option = row.add_(app);
    if (row.check_) option->check(*row.check_);
    if (!row.values_.empty()) option->option_text(row.values_);
    option->required(row.required_);
  }
}

namespace {

std::string joined(const std::vector<std::string>& words) {
  std::string text;
  for (const std::string& word : words) text += (text.empty() ? "" : " ") + word;
  return text;
}

/// Says what is wrong with a command line. CLI11 speaks of what is missing first, which hides an option or a
/// command that was misspelt, and names surplus arguments backwards.
std::string usage_defect(const CLI::App& app, const CLI::ParseError& error) {
  const std::vector<std::string> surplus = app.remaining(true);
  const bool knows_of_surplus = error.get_exit_code() == static_cast<int>(CLI::ExitCodes::RequiredError) ||
                                error.get_exit_code() == static_cast<int>(CLI::ExitCodes::ExtrasError);
  if (surplus.empty() || !knows_of_surplus) return error.what();
  for (const std::string& argument : surplus)
    if (argument.starts_with('-') && argument != "--") return "there is no option " + argument;
  const bool wants_command = app.get_require_subcommand_min() > 0 && app.get_subcommands().empty();
  if (wants_command) return "there is no command " + surplus.front();
  return "not expected: " + joined(surplus);
}

}  // namespace

bool parse_command_line(CLI::App& app, int argc, char** argv, ExitCode& exit_code) {
  exit_code = kDone;
  try {
    app.parse(argc, argv);
    return true;
  } catch (const CLI::Success& done) {  // --help, --version
    app.exit(done);
  } catch (const CLI::ParseError& error) {
    const std::string defect = printable(usage_defect(app, error));
    std::fprintf(stderr, "%s: %s\nTry '%s --help'.\n", app.get_name().c_str(), defect.c_str(),
                 app.get_name().c_str());
    exit_code = kUsage;
  }
  return false;
}

void keep_inputs(const std::string& output, const std::vector<std::string>& inputs) {
  for (const std::string& input : inputs) {
    std::error_code missing;  // then nothing can be overwritten
    if (std::filesystem::equivalent(output, input, missing)) {
      throw UsageError(output + ": would be overwritten, and is read too");
    }
  }
}

}  // namespace tandem
