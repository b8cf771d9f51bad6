#include "query_command.h"

#include <chrono>
#include <cstdio>
#include <memory>
#include <new>
#include <thread>

#include "contacts_file.h"
#include "hdf5_file.h"
#include "scene_file.h"
#include "statistics_json.h"

namespace tandem::bench {
namespace {

struct QueryArguments {
  std::string scene, out, backend = "cpu";
  QueryOptions options;
  std::uint32_t repeats = 1;
  bool json = false;
};

const std::map<std::string, QueryMode> kModes = {
    {"exact", QueryMode::exact}, {"fast", QueryMode::fast}, {"boxes", QueryMode::boxes}};

std::string name_of(QueryMode mode) {
  for (const auto& [name, value] : kModes) {
    if (value == mode) return name;
  }
  return {};
}

[[noreturn]] void refuse(const std::string& scene, Status status, std::uint64_t where) {
  if (status == Status::kOutOfMemory) throw std::bad_alloc();
  const char* unit = subject(status);
  const std::string blamed = unit == nullptr ? "" : std::string(unit) + " " + std::to_string(where) + ": ";
  const std::string text = scene + ": " + blamed + explain(status);
  if (status == Status::kCannotStartThread) throw std::runtime_error(text);
  throw FileError(text);
}

void check(const std::string& scene, Status status, const ContactQuery& query) {
  if (status != Status::kOk) refuse(scene, status, query.where());
}

// Runs the query as often as asked; the answer is the last run's, which is every run's.
QueryRecord run_query(const QueryArguments& arguments, const Scene& scene, ContactQuery& query) {
  const SceneDescription& description = scene.description;
  const std::vector<ObjectPair> pairs = normalised(description.pairs.value_or(std::vector<ObjectPair>()));
  const std::vector<AssetView> views = scene.views();
  QueryRecord record;
  check(arguments.scene, query.set_assets(views), query);
  for (std::uint32_t i = 0; i < arguments.repeats; ++i) {
    const auto start = std::chrono::steady_clock::now();
    const Status status = description.pairs
                              ? query.find_contacts(description.instances, pairs, arguments.options)
                              : query.find_contacts(description.instances, arguments.options);
    record.seconds.push_back(std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count());
    check(arguments.scene, status, query);
  }
  record.mode = name_of(arguments.options.mode);
  record.backend = arguments.backend;
  record.first_contact = arguments.options.first_contact_only;
  record.self_pairs = arguments.options.self_pairs;
  record.given_pairs = description.pairs.has_value();
  record.threads = arguments.options.threads;
  record.counters = query.counters();
  return record;
}

std::uint64_t triangles_of(const Scene& scene) {
  std::uint64_t triangles = 0;
  for (const Instance& instance : scene.description.instances) {
    triangles += scene.assets[instance.asset].view().level().triangle_count;
  }
  return triangles;
}

Json to_json(const QueryArguments& arguments, const Scene& scene, const QueryRecord& record,
             std::uint64_t hash) {
  const QueryCounters& counters = record.counters;
  return {{"tool", "bvhbench query"},
          {"version", TANDEM_VERSION},
          {"scene", arguments.scene},
          {"output", arguments.out.empty() ? Json() : Json(arguments.out)},
          {"backend", record.backend},
          {"mode", record.mode},
          {"first_contact", record.first_contact},
          {"self_pairs", record.self_pairs},
          {"given_pairs", record.given_pairs},
          {"threads", record.threads},
          {"assets", scene.assets.size()},
          {"instances", scene.description.instances.size()},
          {"triangles", triangles_of(scene)},
          {"object_pairs", counters.object_pairs},
          {"block_pairs", counters.block_pairs},
          {"candidates", counters.candidates},
          {"decided_by_float32", counters.decided_by_float32},
          {"decided_by_float64", counters.decided_by_float64},
          {"decided_exactly", counters.decided_exactly},
          {"contacts", counters.contacts},
          {"hash", hexadecimal(hash)},
          {"seconds",
           {{"best", record.best_seconds()}, {"median", record.median_seconds()}, {"all", record.seconds}}}};
}

void print_row(const char* label, std::uint64_t value, const char* remark = "") {
  std::printf("  %-14s %15s%s\n", label, with_commas(value).c_str(), remark);
}

void print_summary(const QueryArguments& arguments, const Scene& scene, const QueryRecord& record,
                   std::uint64_t hash) {
  const QueryCounters& counters = record.counters;
  std::printf("%s: %s on %s, %s %s\n", arguments.scene.c_str(), record.mode.c_str(), record.backend.c_str(),
              with_commas(record.threads).c_str(), record.threads == 1 ? "thread" : "threads");
  print_row("instances", scene.description.instances.size());
  print_row("triangles", triangles_of(scene));
  print_row("object pairs", counters.object_pairs, record.given_pairs ? "  given" : "  found");
  print_row("block pairs", counters.block_pairs);
  print_row("candidates", counters.candidates);
  if (arguments.options.mode == QueryMode::exact) {
    print_row("  by float32", counters.decided_by_float32);
    print_row("  by float64", counters.decided_by_float64);
    print_row("  exactly", counters.decided_exactly);
  }
  print_row("contacts", counters.contacts);
  std::printf("  %-14s %15.3f  best of %zu, median %.3f%s\n", "milliseconds", 1e3 * record.best_seconds(),
              record.seconds.size(), 1e3 * record.median_seconds(),
              record.given_pairs ? "; without the broad phase" : "");
  std::printf("  %-14s %s\n", "hash", hexadecimal(hash).c_str());
}

ExitCode run(const QueryArguments& arguments) {
  const Scene scene = read_scene(arguments.scene);
  if (arguments.options.self_pairs && scene.description.pairs) {
    throw UsageError(arguments.scene + ": gives its object pairs, so --self has nothing to add");
  }
  ContactQuery query;
  const QueryRecord record = run_query(arguments, scene, query);
  const ContactTable table = make_table(query.pairs(), query.contacts());
  if (!arguments.out.empty()) write_contacts(arguments.out, table, record);
  if (arguments.json) {
    std::puts(pretty(to_json(arguments, scene, record, hash_of(table))).c_str());
  } else {
    print_summary(arguments, scene, record, hash_of(table));
  }
  return kDone;
}

CLI::Validator backend() {
  const auto defect = [](const std::string& word) -> std::string {
    if (word == "cpu") return {};
    return word == "cuda" ? "queries on a GPU are not there yet" : word + " is neither cpu nor cuda";
  };
  return CLI::Validator(defect, "");
}

}  // namespace

CLI::App* add_query(CLI::App& app, Run& run_later) {
  const auto arguments = std::make_shared<QueryArguments>();
  QueryOptions& options = arguments->options;
  options.threads = std::max(1u, std::thread::hardware_concurrency());
  CLI::App* command = app.add_subcommand("query", "find every pair of triangles that meet in a scene");
  command->add_option("SCENE", arguments->scene, "scene file (HDF5)")->required()->check(file_name());
  command->add_option("--backend", arguments->backend, "what the query runs on")
      ->check(backend())
      ->option_text("cpu [cpu]");
  add_choice(*command, "--mode", kModes, options.mode,
             "'exact' contacts, 'fast' ones by float32, or 'boxes': candidates")
      ->option_text("exact|fast|boxes [exact]");
  command->add_flag("--first-contact", options.first_contact_only,
                    "one contact for each object pair at most");
  command->add_flag("--self", options.self_pairs, "also each instance with itself");
  command->add_option("--threads", options.threads, "threads; the contacts do not depend on them")
      ->check(CLI::Range(1, 4096))
      ->option_text("N [all]");
  command->add_option("--repeat", arguments->repeats, "times to run the query, for its timing")
      ->check(CLI::Range(1, 1000000))
      ->option_text("N [1]");
  command->add_option("--out", arguments->out, "the contacts file to write; appears whole or not at all")
      ->check(file_name());
  command->add_flag("--json", arguments->json, "print the summary as JSON");
  command->final_callback([arguments, &run_later] { run_later = [arguments] { return run(*arguments); }; });
  return command;
}

}  // namespace tandem::bench
