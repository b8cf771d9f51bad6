#include "simulate_command.h"

#include <tbb/global_control.h>

#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <thread>

#include "bvhbench/engines/registry.h"
#include "bvhbench/scenes/hdf5_file.h"
#include "bvhbench/scenes/make_scene_parts.h"
#include "bvhbench/scenes/scene_file.h"
#include "bvhbench/simulator/preparation.h"
#include "bvhbench/simulator/run.h"
#include "common/json.h"
#include "common/number_words.h"

namespace tandem::bench {
namespace {

namespace fs = std::filesystem;
using namespace simulation;

struct SimulateArguments {
  std::string mesh, ground, scene, engine = "tandem";
  std::uint32_t count = 0;
  double jitter = 0.0005, tilt = 30, density = 1000, gravity = 9.81, slop = -1, rolling_resistance = -1;
  std::uint64_t seed = 1;
  bool fast = false, json = false, cold = false, continuous = false;
  SimulatorOptions simulator;
  ContactPointOptions contacts;
  RunOptions run;
};

const std::map<std::string, SolverKind> kSolvers = {{"auto", SolverKind::automatic},
                                                    {"soft", SolverKind::soft},
                                                    {"newton", SolverKind::newton},
                                                    {"sweeps", SolverKind::sweeps}};

std::string solver_name(SolverKind kind) {
  const auto is_it = [&](const auto& entry) { return entry.second == kind; };
  return std::find_if(kSolvers.begin(), kSolvers.end(), is_it)->first;
}

// Meshes and bodies, before anything moves.
struct Start {
  LoadedScene scene;  // its assets; instances of scene files alone
  std::vector<std::string> paths;
  Preparation bodies;
  std::optional<Reentry> reentry;

  std::vector<AssetView> shapes() const { return scene.views(); }
};

// How a kind of configuration is set up.
using SetUp = std::function<void(const SimulateArguments&, Start&)>;

void open(Start& start, const std::vector<std::string>& paths) {
  for (const std::string& path : paths) {
    if (path.empty()) continue;
    start.scene.add(open_mesh(path));
    start.paths.push_back(path);
  }
}

double slop_of(const SimulateArguments& arguments, const Start& start) {
  return arguments.slop >= 0 ? arguments.slop : default_slop(start.scene.assets[0].view());
}

void set_up_stack(const SimulateArguments& arguments, Start& start) {
  open(start, {arguments.mesh});
  const auto shapes = start.shapes();
  const Configuration stack = structured_stack(shapes[0], root_above(arguments.count, 3), arguments.jitter,
                                               slop_of(arguments, start), arguments.seed);
  start.bodies = prepare(stack, shapes, start.paths, arguments.density);
}

void set_up_pile(const SimulateArguments& arguments, Start& start) {
  open(start, {arguments.mesh, arguments.ground});
  const auto shapes = start.shapes();
  const Configuration pile = unstructured_pile(shapes[0], shapes[1], arguments.count, arguments.seed);
  start.bodies = prepare(pile, shapes, start.paths, arguments.density);
}

void set_up_slide(const SimulateArguments& arguments, Start& start) {
  open(start, {arguments.mesh, arguments.ground});
  const auto shapes = start.shapes();
  Configuration slide;
  try {
    slide = rock_slide(shapes[0], shapes[1], arguments.count, arguments.tilt, arguments.seed);
  } catch (const std::runtime_error& impossible) {
    throw UsageError(arguments.ground + ": " + impossible.what());
  }
  start.bodies = prepare(slide, shapes, start.paths, arguments.density);
  const auto sheets =
      static_cast<std::size_t>(std::count(slide.motion.begin(), slide.motion.end(), Motion::fixed));
  start.reentry.emplace(shapes[1], std::span(slide.instances).first(sheets), arguments.tilt, arguments.seed);
}

void set_up_scene(const SimulateArguments& arguments, Start& start) {
  start.scene = read_scene(arguments.scene);
  for (const std::string& asset : start.scene.description.assets) {
    start.paths.push_back((fs::path(arguments.scene).parent_path() / asset).string());
  }
  if (start.paths.empty()) throw FileError(arguments.scene + ": /assets: there is none");
  start.bodies = prepare_scene(arguments.scene, start.scene, arguments.density);
}

// What decides the results, for the file and for going on with it.
Json options_of(const char* kind, const SimulateArguments& arguments, const Start& start) {
  const SimulatorOptions& simulator = arguments.simulator;
  const SolverOptions& solver = simulator.solver;
  return {{"configuration", kind},
          {"start", hexadecimal(hash_of(start.bodies.bodies, start.bodies.states, start.scene))},
          {"seed", arguments.seed},
          {"engine", arguments.engine},
          {"mode", arguments.fast ? "fast" : "exact"},
          {"points_per_patch", arguments.contacts.points_per_patch},
          {"dt", simulator.dt},
          {"solver", solver_name(solver.kind)},
          {"substeps", solver.substeps},
          {"gravity", arguments.gravity},
          {"iterations", solver.iterations},
          {"position_iterations", solver.position_iterations},
          {"friction", solver.friction},
          {"restitution", solver.restitution},
          {"slop", solver.slop},
          {"rolling_resistance", solver.rolling_resistance},
          {"correction", solver.correction},
          {"order", solver.order == ContactOrder::found ? "found" : "shuffled"},
          {"warm_start", solver.warm_start},
          {"shock_propagation", solver.shock_propagation},
          {"sleeping", simulator.sleep.enabled},
          {"sleep_speed", simulator.sleep.speed},
          {"continuous", arguments.continuous},
          {"trajectory", arguments.run.trajectory_every}};
}

RunDescription describe(const char* kind, const SimulateArguments& arguments, const Start& start) {
  RunDescription run;
  run.options = options_of(kind, arguments, start);
  for (const std::string& path : start.paths) run.assets.push_back(seen_from(arguments.run.output, path));
  run.shapes = start.scene.shapes;
  run.bodies = start.bodies.bodies;
  run.triangles = start.bodies.triangles;
  return run;
}

struct Means {
  double step = 0, collision = 0, contacts = 0, solver = 0, ratio = 0;
};

Means means_of(const std::vector<StepRecord>& records) {
  Means means;
  const auto count = static_cast<double>(records.size());
  for (const StepRecord& record : records) {
    means.step += record.step_seconds / count;
    means.collision += (record.update_seconds + record.broad_phase_seconds + record.traversal_seconds +
                        record.triangle_test_seconds + record.transfer_seconds) /
                       count;
    means.contacts += record.contact_seconds / count;
    means.solver += record.solver_seconds / count;
    means.ratio += record.contact_ratio / count;
  }
  return means;
}

Json to_json(const char* kind, const SimulateArguments& arguments, const RunDescription& run,
             const RunResults& results) {
  const Means means = means_of(results.records);
  const StepRecord& last = results.records.back();
  return {{"tool", "bvhbench simulate"},
          {"version", TANDEM_VERSION},
          {"configuration", kind},
          {"output", arguments.run.output},
          {"bodies", run.bodies.size()},
          {"triangles", run.triangles},
          {"steps", results.records.size()},
          {"options", run.options},
          {"seconds_per_step",
           {{"all", means.step},
            {"collision", means.collision},
            {"contacts", means.contacts},
            {"solver", means.solver}}},
          {"contact_ratio", means.ratio},
          {"last",
           {{"contacts", last.contacts},
            {"penetration_max", last.penetration_max},
            {"speed_max", last.speed_max},
            {"spin_max", last.spin_max},
            {"residual_max", last.residual_max},
            {"kinetic_energy", last.kinetic_energy}}}};
}

void print_summary(const SimulateArguments& arguments, const RunDescription& run, const RunResults& results) {
  const Means means = means_of(results.records);
  const StepRecord& last = results.records.back();
  std::printf("%s: %s steps of %s bodies\n", arguments.run.output.c_str(),
              with_commas(results.records.size()).c_str(), with_commas(run.bodies.size()).c_str());
  std::printf("  %-18s %10.3f  collision %.3f, contacts %.3f, solver %.3f\n", "milliseconds",
              1e3 * means.step, 1e3 * means.collision, 1e3 * means.contacts, 1e3 * means.solver);
  std::printf("  %-18s %10.4f  triangle pairs by triangles, mean\n", "contact ratio", means.ratio);
  std::printf("  %-18s %10s  in the last step\n", "contacts", with_commas(last.contacts).c_str());
  std::printf("  %-18s %10.2e  in the last step\n", "penetration", last.penetration_max);
  std::printf("  %-18s %10.2e  of the fastest body at the end; %.2e by turning\n", "speed", last.speed_max,
              last.spin_max);
}

// Whether the run is there already: with --resume there is nothing left to do.
bool is_done(const SimulateArguments& arguments, const RunDescription& run) {
  if (!arguments.run.resume || !fs::exists(arguments.run.output)) return false;
  return read_run(arguments.run.output, run).records.size() == arguments.run.steps;
}

ExitCode run(const char* kind, SimulateArguments arguments, const SetUp& set_up) {
  keep_inputs(arguments.run.output, {arguments.mesh, arguments.ground, arguments.scene});
  try_output(arguments.run.output);
  Start start;
  set_up(arguments, start);
  for (const std::string& finding : start.bodies.findings)
    std::fprintf(stderr, "bvhbench: %s\n", finding.c_str());
  SimulatorOptions& options = arguments.simulator;
  options.gravity = {0, 0, -arguments.gravity};
  options.solver.slop = slop_of(arguments, start);
  options.solver.rolling_resistance =
      arguments.rolling_resistance >= 0 ? arguments.rolling_resistance : 16 * options.solver.slop;
  options.solver.warm_start = !arguments.cold;
  options.solver.seed = arguments.seed;
  if (options.solver.substeps == 0) options.solver.substeps = default_substeps(options.solver.kind);
  const RunDescription description = describe(kind, arguments, start);
  if (is_done(arguments, description)) {
    std::printf("%s: is done\n", arguments.run.output.c_str());
    return kDone;
  }
  const tbb::global_control threads(tbb::global_control::max_allowed_parallelism, options.threads);
  arguments.contacts.threads = options.threads;
  auto engine = make_engine(arguments.engine, {.mode = arguments.fast ? QueryMode::fast : QueryMode::exact,
                                               .threads = options.threads});
  std::unique_ptr<ContinuousMotion> continuous;
  if (arguments.continuous) continuous = std::make_unique<ContinuousMotion>(start.shapes(), options.threads);
  Simulator simulator(start.bodies.bodies, start.bodies.states,
                      make_mesh_contact_finder(std::move(engine), start.shapes(), arguments.contacts),
                      options, std::move(continuous));
  const RunResults results = run_simulation(simulator, description, start.reentry, arguments.run);
  if (arguments.json) {
    std::puts(pretty(to_json(kind, arguments, description, results)).c_str());
  } else {
    print_summary(arguments, description, results);
  }
  return kDone;
}

const std::map<std::string, ContactOrder> kOrders = {{"found", ContactOrder::found},
                                                     {"shuffled", ContactOrder::shuffled}};

CLI::Validator engine_name() {
  const auto defect = [](const std::string& name) -> std::string {
    const auto names = engine_names();
    if (std::find(names.begin(), names.end(), name) == names.end()) {
      std::string known;
      for (const std::string_view one : names) known += (known.empty() ? "" : ", ") + std::string(one);
      return name + " is none of " + known;
    }
    return is_built_in(name) ? std::string() : "this bvhbench was built without " + name;
  };
  return CLI::Validator(defect, "");
}

void add_solver_options(CLI::App& command, SimulateArguments& arguments) {
  SimulatorOptions& simulator = arguments.simulator;
  SolverOptions& solver = simulator.solver;
  add_choice(command, "--solver", kSolvers, solver.kind,
             "how a step is solved: 'soft' or 'newton', 'auto' of these two, or 'sweeps'")
      ->option_text("auto|soft|newton|sweeps [auto]");
  command.add_option("--dt", simulator.dt, "seconds of a step")
      ->check(between(1e-9, 1e3))
      ->option_text("SECONDS [1/60]");
  command.add_option("--substeps", solver.substeps, "parts of a step that share its contacts")
      ->check(CLI::Range(1, 10'000))
      ->option_text("N [16, with sweeps 1]");
  command.add_option("--iterations", solver.iterations, "sweeps for velocities in each part of a step")
      ->check(CLI::Range(0, 1'000'000))
      ->option_text("N [30]");
  command
      .add_option("--position-iterations", solver.position_iterations,
                  "sweeps for the correction of penetration in each part")
      ->check(CLI::Range(0, 1'000'000))
      ->option_text("N [30]");
  command.add_option("--gravity", arguments.gravity, "along -z, in m/s^2")
      ->check(between(-1e6, 1e6))
      ->option_text("G [9.81]");
  command.add_option("--friction", solver.friction, "coefficient of friction")
      ->check(between(0, 1e6))
      ->option_text("MU [0.5]");
  command.add_option("--restitution", solver.restitution, "part of the speed that an impact gives back")
      ->check(between(0, 1))
      ->option_text("E [0]");
  command.add_option("--slop", arguments.slop, "penetration that is left alone, in metres")
      ->check(between(0, 1e6))
      ->option_text("S [1/4000 of the first mesh's diagonal]");
  command
      .add_option(
          "--rolling-resistance", arguments.rolling_resistance,
          "lever at which the force between two bodies resists that they turn, in metres; not by sweeps")
      ->check(between(0, 1e6))
      ->option_text("L [16 times the slop]");
  command
      .add_option("--correction", solver.correction,
                  "part of the penetration beyond the slop that a step corrects")
      ->check(between(0, 1))
      ->option_text("B [0.2]");
  add_choice(command, "--order", kOrders, solver.order,
             "in which contacts are solved: as 'found', or 'shuffled'")
      ->option_text("found|shuffled [found]");
  command.add_flag("--cold", arguments.cold, "start each step without the impulses of the step before");
  command.add_flag("--shock", solver.shock_propagation,
                   "propagate shocks from the ground up after the sweeps");
  command.add_flag("--sleep", simulator.sleep.enabled, "let islands at rest fall asleep");
  command.add_flag("--continuous", arguments.continuous,
                   "carry fast bodies to where they first meet others, so that none passes through");
  command.add_option("--sleep-speed", simulator.sleep.speed, "below which a body is at rest, in m/s")
      ->check(between(0, 1e6))
      ->option_text("V [0.01]");
}

void add_run_options(CLI::App& command, SimulateArguments& arguments) {
  RunOptions& run = arguments.run;
  command.add_option("--frames", run.steps, "steps to make")
      ->required()
      ->check(CLI::Range(1, 1'000'000'000))
      ->option_text("N");
  command.add_option("--engine", arguments.engine, "what finds the triangles that meet")
      ->check(engine_name())
      ->option_text("NAME [tandem]");
  command.add_flag("--fast", arguments.fast, "let the engine decide triangles in float32");
  command.add_option("--points-per-patch", arguments.contacts.points_per_patch, "contact points, at most")
      ->check(CLI::Range(1u, kMostManifoldPoints))
      ->option_text("N [" + std::to_string(arguments.contacts.points_per_patch) + "]");
  command.add_option("--density", arguments.density, "of the bodies, in kg/m^3")
      ->check(between(1e-12, 1e12))
      ->option_text("D [1000]");
  command.add_option("--threads", arguments.simulator.threads, "threads; the results do not depend on them")
      ->check(CLI::Range(1u, kMostQueryThreads))
      ->option_text("N [all]");
  command.add_option("--trajectory", run.trajectory_every, "keep the state after every K-th step; 0: none")
      ->option_text("K [0]");
  command.add_option("--checkpoint", run.checkpoint_seconds, "seconds between two writings of OUTPUT.part")
      ->check(between(0, 1e9))
      ->option_text("S [60]");
  command.add_flag("--resume", run.resume, "go on from OUTPUT.part; nothing to do where OUTPUT is done");
  command.add_flag("--json", arguments.json, "print the summary as JSON");
  command.add_option("-o,--output", run.output, "the run file to write; appears whole or not at all")
      ->required()
      ->check(file_name());
}

CLI::App* add_kind(CLI::App& simulate, Run& run_later, const std::shared_ptr<SimulateArguments>& arguments,
                   const char* kind, const char* help, const SetUp& set_up) {
  CLI::App* command = simulate.add_subcommand(kind, help);
  add_solver_options(*command, *arguments);
  add_run_options(*command, *arguments);
  command->final_callback([=, &run_later] { run_later = [=] { return run(kind, *arguments, set_up); }; });
  return command;
}

// What the paper's configurations have and scene files have not.
void add_configuration(CLI::App& command, SimulateArguments& arguments, std::uint32_t count) {
  arguments.count = count;
  command.add_option("--mesh", arguments.mesh, ".bvh file of the bodies")->required()->check(file_name());
  command.add_option("--count", arguments.count, "how many")
      ->check(CLI::Range(1, 10'000'000))
      ->option_text("N [" + std::to_string(count) + "]");
  command.add_option("--seed", arguments.seed, "another start of the kind; and of --order shuffled")
      ->check(CLI::NonNegativeNumber)
      ->option_text("N [1]");
}

void add_ground(CLI::App& command, SimulateArguments& arguments) {
  command.add_option("--ground", arguments.ground, ".bvh file of the ground, which is fixed")
      ->required()
      ->check(file_name());
}

}  // namespace

CLI::App* add_simulate(CLI::App& app, Run& run_later) {
  CLI::App* simulate = app.add_subcommand("simulate", "let bodies move, and keep what that takes");
  simulate->require_subcommand(1);
  const auto add = [&](const char* kind, const char* help, const SetUp& set_up) {
    const auto arguments = std::make_shared<SimulateArguments>();
    arguments->simulator.threads = std::max(1u, std::thread::hardware_concurrency());
    return std::pair(add_kind(*simulate, run_later, arguments, kind, help, set_up), arguments);
  };

  const auto [slide, sliding] =
      add("slide", "rocks that slide down a tilted ground, again and again", set_up_slide);
  add_configuration(*slide, *sliding, 1000);
  add_ground(*slide, *sliding);
  slide->add_option("--tilt", sliding->tilt, "slope of the ground along x")
      ->check(between(0, 80))
      ->option_text("DEGREES [30]");
  sliding->simulator.solver.friction = 0.4;
  slide->get_option("--friction")->option_text("MU [0.4]");

  const auto [pile, falling] = add("pile", "bodies that fall on the ground and on each other", set_up_pile);
  add_configuration(*pile, *falling, 1000);
  add_ground(*pile, *falling);

  const auto [stack, standing] = add("stack", "a cube of boxes on a floor of boxes", set_up_stack);
  add_configuration(*stack, *standing, 1000);
  stack->get_option("--count")->check(cube_of_a_whole_number());
  stack
      ->add_option("--jitter", standing->jitter,
                   "how far boxes are moved along x and y at most, in box lengths")
      ->check(between(0, 0.1))
      ->option_text("J [0.0005]");

  const auto [scene, any] = add("scene", "the bodies of a scene file", set_up_scene);
  scene->add_option("SCENE", any->scene, "scene file (HDF5)")->required()->check(file_name());
  scene->add_option("--seed", any->seed, "of --order shuffled")
      ->check(CLI::NonNegativeNumber)
      ->option_text("N [1]");
  return simulate;
}

}  // namespace tandem::bench
