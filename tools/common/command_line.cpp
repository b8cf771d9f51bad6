#include "command_line.h"

#include <CLI/CLI.hpp>
#include <array>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <filesystem>

#include "number_words.h"
#include "path_text.h"
#include "printable.h"
#include "process.h"
#include "real_from_text.h"

namespace tandem {
namespace {

std::string joined(const std::vector<std::string>& words, const char* between) {
  std::string text;
  for (const std::string& word : words) text += (text.empty() ? "" : between) + word;
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
  return "not expected: " + joined(surplus, " ");
}

CLI::Validator validator(const Check& check) {
  return CLI::Validator([check](const std::string& text) { return check(text); }, "");
}

}  // namespace

std::optional<double> number_in(const std::string& text) {
  double number = 0;
  const char* begin = text.data() + (text.starts_with('+') ? 1 : 0);
  const auto [end, error] = real_from_text(begin, text.data() + text.size(), number);
  return error == std::errc() && end == text.data() + text.size() ? std::optional(number) : std::nullopt;
}

Check between(double lower, double upper) {
  return [lower, upper](const std::string& text) -> std::string {
    const std::optional<double> value = number_in(text);
    if (value && *value >= lower && *value <= upper) return "";
    return format("%s is no number from %.15g to %.15g", text.c_str(), lower, upper);
  };
}

Check file_name() {
  return [](const std::string& text) -> std::string {
    if (text.empty()) return "a file needs a name";
    return text == "-" ? "- is not standard input or output here; ./- names a file" : "";
  };
}

Check one_of(std::vector<std::string> words) {
  return [words = std::move(words)](const std::string& text) -> std::string {
    const bool known = std::find(words.begin(), words.end(), text) != words.end();
    return known ? "" : text + " is none of " + joined(words, ", ");
  };
}

template <typename T>
OptionRow::OptionRow(const char* name, T& value, std::string values, std::string help, Check check)
    : values_(std::move(values)), check_(std::move(check)) {
  add_ = [=, &value](CLI::App& app) { return app.add_option(name, value, help); };
}

#define TANDEM_OPTION_OF(...) \
  template OptionRow::OptionRow(const char*, __VA_ARGS__&, std::string, std::string, Check)
TANDEM_OPTION_OF(std::string);
TANDEM_OPTION_OF(std::vector<std::string>);
TANDEM_OPTION_OF(double);
TANDEM_OPTION_OF(std::optional<double>);
TANDEM_OPTION_OF(std::vector<double>);
TANDEM_OPTION_OF(std::array<double, 3>);
TANDEM_OPTION_OF(std::optional<std::array<double, 3>>);
TANDEM_OPTION_OF(std::uint32_t);
TANDEM_OPTION_OF(std::optional<std::uint32_t>);
TANDEM_OPTION_OF(std::uint64_t);
TANDEM_OPTION_OF(std::optional<std::uint64_t>);

OptionRow::OptionRow(const char* name, std::function<void(const std::string&)> take, std::string values,
                     std::string help, Check check)
    : values_(std::move(values)), check_(std::move(check)) {
  add_ = [=](CLI::App& app) { return app.add_option_function<std::string>(name, take, help); };
}

OptionRow::OptionRow(const char* name, std::filesystem::path& path, std::string values, std::string help,
                     Check check)
    : OptionRow(
          name, [&path](const std::string& text) { path = path_of(text); }, std::move(values),
          std::move(help), std::move(check)) {}

OptionRow::OptionRow(const char* name, bool& given, std::string help) {
  add_ = [=, &given](CLI::App& app) { return app.add_flag(name, given, help); };
}

OptionRow::OptionRow(const char* name, Cleared cleared, std::string help) {
  const auto clear = [&value = cleared.value] { value = false; };
  add_ = [=](CLI::App& app) { return app.add_flag_callback(name, clear, help); };
}

OptionRow required(OptionRow row) {
  row.required_ = true;
  return row;
}

OptionRow separated_by_commas(OptionRow row) {
  row.separated_by_commas_ = true;
  return row;
}

OptionRow in_bytes(OptionRow row) {
  row.in_bytes_ = true;
  return row;
}

void Command::add(std::initializer_list<OptionRow> rows) const {
  for (const OptionRow& row : rows) {
    CLI::Option* option = row.add_(*app_);
    if (row.check_) option->check(validator(row.check_));
    if (row.in_bytes_) option->transform(CLI::AsSizeValue(false));
    if (row.separated_by_commas_) option->delimiter(',');
    if (!row.values_.empty()) option->option_text(row.values_);
    option->required(row.required_);
  }
}

Command Command::add_command(const char* name, const char* help, std::function<void()> chosen) const {
  CLI::App* command = app_->add_subcommand(name, help);
  if (chosen) command->final_callback(std::move(chosen));
  return Command(command);
}

void Command::require_command() const {
  app_->require_subcommand(1);
}

Command Command::add_choice(const char* name) const {
  CLI::App* group = app_->add_option_group(name);
  group->require_option(1);
  return Command(group);
}

void Command::check(const char* option, const Check& check) const {
  app_->get_option(option)->check(validator(check));
}

void Command::take_values(const char* option, int count) const {
  app_->get_option(option)->expected(count);
}

void Command::exclude(const char* option, const char* other) const {
  app_->get_option(option)->excludes(app_->get_option(other));
}

void Command::need(const char* option, const char* other) const {
  app_->get_option(option)->needs(app_->get_option(other));
}

void Command::end_help(const std::string& text) const {
  app_->footer(text);
}

Tool::Tool(const char* name, const char* help, const char* version) : Command(new CLI::App(help, name)) {
  app_->allow_windows_style_options(false);  // an argument such as /tmp/cow.obj is a file
  app_->set_version_flag("--version", std::string(name) + " " + version);
  prepare_process(name);
}

Tool::~Tool() {
  delete app_;
}

bool Tool::parse(int argc, char** argv, ExitCode& exit_code) const {
  exit_code = kDone;
  try {
    app_->parse(argc, argv);
    return true;
  } catch (const CLI::Success& done) {  // --help, --version
    app_->exit(done);
  } catch (const CLI::ParseError& error) {
    const std::string defect = printable(usage_defect(*app_, error));
    const std::string name = app_->get_name();
    std::fprintf(stderr, "%s: %s\nTry '%s --help'.\n", name.c_str(), defect.c_str(), name.c_str());
    exit_code = kUsage;
  }
  return false;
}

void keep_inputs(const std::string& output, const std::vector<std::string>& inputs) {
  for (const std::string& input : inputs) {
    std::error_code missing;  // then nothing can be overwritten
    if (std::filesystem::equivalent(path_of(output), path_of(input), missing)) {
      throw UsageError(output + ": would be overwritten, and is read too");
    }
  }
}

}  // namespace tandem
