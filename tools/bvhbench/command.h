#pragma once
#include <functional>
#include <memory>
#include <utility>

#include "bvhbench/engines/engine.h"
#include "bvhbench/scenes/scene_file.h"
#include "common/command_line.h"
#include "common/exit_code.h"
#include "common/report.h"

/// This header has the list of bvhbench's subcommands and what they share.
namespace tandem::bench {

/// The action that a parsed command line asks for; main() runs it. Throws UsageError, FileError, OutputError.
using Run = std::function<ExitCode()>;

// Each subcommand is a line here and in main().
void add_scene(Command tool, Run& run_later);
void add_query(Command tool, Run& run_later);
void add_impact(Command tool, Run& run_later);
void add_distance(Command tool, Run& run_later);
void add_compare(Command tool, Run& run_later);
void add_simulate(Command tool, Run& run_later);
void add_deform(Command tool, Run& run_later);
void add_economy(Command tool, Run& run_later);
void add_frame(Command tool, Run& run_later);
void add_poses(Command tool, Run& run_later);
void add_probe(Command tool, Run& run_later);

/// Adds a subcommand that runs with the arguments that its command line fills. Result: the subcommand, which
/// has no options yet, and the arguments that these are to be bound to.
template <typename Arguments>
std::pair<Command, Arguments&> add_command(Command tool, Run& run_later, const char* name, const char* help,
                                           std::function<ExitCode(const Arguments&)> run) {
  const auto arguments = std::make_shared<Arguments>();
  const auto chosen = [=, &run_later] { run_later = [=] { return run(*arguments); }; };
  return {tool.add_command(name, help, chosen), *arguments};
}

/// The values of the options that most commands have.
struct CommonArguments {
  std::string scene, output, backend = "cpu";
  std::optional<std::uint32_t> told_threads;
  std::uint32_t repeats = 1;
  bool json = false;

  bool on_gpu() const { return backend == "cuda"; }
  /// Returns the threads of the CPU: as many as told, or as the machine has.
  std::uint32_t threads() const;
};

/// Rows of these options. `what`: the rest of the help; of the threads, what the results do, "the contacts
/// do".
OptionRow scene_argument(CommonArguments& arguments, const std::string& what = "scene file (HDF5)");
OptionRow backend_option(CommonArguments& arguments);
OptionRow threads_option(CommonArguments& arguments, const std::string& what);
OptionRow repeat_option(CommonArguments& arguments, const std::string& what = "the query");
OptionRow output_option(CommonArguments& arguments, const std::string& what, const char* name = "--out");
OptionRow json_option(CommonArguments& arguments, const std::string& what = "the summary");

/// Rows of the options that commands have that set out bodies themselves. count_option() sets the usual
/// count.
OptionRow mesh_option(std::string& mesh);
OptionRow ground_option(std::string& ground, const std::string& what);
OptionRow count_option(std::uint32_t& count, std::uint32_t usual);
OptionRow seed_option(std::uint64_t& seed, const std::string& what);

/// Returns whether this program was built with CUDA.
bool has_cuda();

/// Prints the report as it was asked for.
void print(const CommonArguments& arguments, const Report& report);

/// Throws where there is an output that would overwrite one of the inputs, or that cannot be written.
void check_output(const CommonArguments& arguments, const std::vector<std::string>& inputs);

/// Throws what a status other than kOk of a query of a scene file calls for. `where`: the instance or pair
/// that is to blame.
[[noreturn]] void refuse(const std::string& scene, Status status, std::uint64_t where);

/// Throws what the error of an engine or a GPU calls for that is being handled, and other errors as they are.
[[noreturn]] void refuse_engine(const std::string& path, const LoadedScene& scene);

/// Returns what `ask` finds in a scene with engines, whose errors end the command as refuse_engine() says.
template <typename Ask>
auto answer_of(const std::string& path, const LoadedScene& scene, const Ask& ask) {
  try {
    return ask();
  } catch (...) {
    refuse_engine(path, scene);
  }
}

/// The scene file and its assets, as paths from here.
std::vector<std::string> files_of(const std::string& path, const LoadedScene& scene);

/// Returns the number of triangles of all instances together.
std::uint64_t triangles_of(const LoadedScene& scene);

/// A Check: refuses what is no cube of a whole number.
std::string cube_defect(const std::string& text);

}  // namespace tandem::bench
