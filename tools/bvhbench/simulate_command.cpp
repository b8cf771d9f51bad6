#include <algorithm>
#include <cstdio>
#include <filesystem>

#include "bvhbench/engines/registry.h"
#include "bvhbench/scenes/hdf5_file.h"
#include "bvhbench/scenes/make_scene.h"
#include "bvhbench/simulator/body_mover.h"
#include "bvhbench/simulator/preparation.h"
#include "bvhbench/simulator/run.h"
#include "command.h"
#include "common/number_words.h"
#include "dynamics/scene_contacts.h"

namespace tandem::bench {
namespace {

namespace fs = std::filesystem;
using namespace simulation;

struct SimulateArguments : CommonArguments {
  std::string mesh, ground, engine = "tandem";
  std::uint32_t count = 0;
  double jitter = 0.0005, tilt = 30, density = 1000, gravity = 9.81, slop = -1, rolling_resistance = -1;
  std::uint64_t seed = 1;
  bool fast = false, ask_all = false, cold = false, continuous = false;
  SimulatorOptions simulator;
  RunOptions run;
};

const std::map<std::string, SolverMethod> kSolvers = {{"auto", SolverMethod::automatic},
                                                      {"soft", SolverMethod::soft},
                                                      {"newton", SolverMethod::newton},
                                                      {"sweeps", SolverMethod::sweeps}};

const std::map<std::string, ContactOrder> kOrders = {{"found", ContactOrder::found},
                                                     {"shuffled", ContactOrder::shuffled}};

// Meshes and bodies, before anything moves.
struct Start {
  LoadedScene scene;  // its assets; instances of scene files alone
  std::vector<std::string> paths;
  Preparation bodies;
  std::optional<Reentry> reentry;
  ExcludedPairTable excluded;
  PairFilter filter;  // of scene files alone

  std::vector<AssetView> shapes() const { return scene.views(); }
};

// Sets up a kind of configuration.
using SetUp = std::function<void(const SimulateArguments&, Start&)>;

void open(Start& start, const std::vector<std::string>& paths) {
  for (const std::string& path : paths) {
    if (path.empty()) continue;
    start.scene.add(open_mesh(path));
    start.paths.push_back(path);
  }
}

double slop_of(const SimulateArguments& arguments, std::span<const AssetView> shapes,
               std::span<const BodyProperties> bodies) {
  return arguments.slop >= 0 ? arguments.slop : default_slop(shapes, bodies);
}

void set_up_stack(const SimulateArguments& arguments, Start& start) {
  open(start, {arguments.mesh});
  const auto shapes = start.shapes();
  const BodyProperties box[] = {{}};
  const Configuration stack = structured_stack(shapes[0], root_above(arguments.count, 3), arguments.jitter,
                                               slop_of(arguments, shapes, box), arguments.seed);
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
  for (const std::string& asset : start.scene.description.assets)
    start.paths.push_back(beside(arguments.scene, asset));
  if (start.paths.empty()) throw FileError(arguments.scene + ": /assets: there is none");
  start.bodies = prepare_scene(arguments.scene, start.scene, arguments.density);
  start.filter = start.scene.description.filter.view(start.excluded);
}

// Returns the options that decide the results, for the file and for going on with it.
Json options_of(const char* kind, const SimulateArguments& arguments, const Start& start) {
  const SimulatorOptions& simulator = arguments.simulator;
  const TestBedSolverOptions& solver = simulator.solver;
  return {{"configuration", kind},
          {"start", hexadecimal(simulation::hash_of(start.bodies.bodies, start.bodies.states, start.scene))},
          {"seed", arguments.seed},
          {"backend", arguments.backend},
          {"engine", arguments.engine},
          {"mode", arguments.fast ? "fast" : "exact"},
          {"points_per_patch", kMostManifoldPoints},
          {"dt", simulator.dt},
          {"solver", name_of(solver.method, kSolvers)},
          {"substeps", solver.substeps},
          {"gravity", arguments.gravity},
          {"iterations", solver.iterations},
          {"position_iterations", solver.position_iterations},
          {"friction", solver.friction},
          {"restitution", solver.restitution},
          {"slop", solver.slop},
          {"rolling_resistance", solver.rolling_resistance},
          {"correction", solver.correction},
          {"order", name_of(solver.order, kOrders)},
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

// Returns the mean over all steps.
template <typename Value>
double mean_of(const std::vector<StepRecord>& records, const Value& value) {
  double mean = 0;
  for (const StepRecord& record : records)
    mean += std::invoke(value, record) / static_cast<double>(records.size());
  return mean;
}

double collision_seconds(const StepRecord& record) {
  return record.update + record.broad_phase + record.traversal + record.triangle_tests + record.transfer;
}

Report report_of(const char* kind, const SimulateArguments& arguments, const RunDescription& run,
                 const RunResults& results) {
  const double collision = mean_of(results.records, collision_seconds);
  const double contacts = mean_of(results.records, &StepRecord::generation);
  const double solver = mean_of(results.records, &StepRecord::solver_seconds);
  const StepRecord& last = results.records.back();
  Report report(18, 10);
  report.line(arguments.output + ": " + with_commas(results.records.size()) + " steps of " +
              with_commas(run.bodies.size()) + " bodies");
  report.add({{"tool", "bvhbench simulate"},
              {"version", TANDEM_VERSION},
              {"configuration", kind},
              {"output", arguments.output},
              {"bodies", run.bodies.size()},
              {"triangles", run.triangles},
              {"steps", results.records.size()},
              {"options", run.options}});
  report.add("seconds_per_step/all", mean_of(results.records, &StepRecord::step_seconds))
      .row("milliseconds", Unit::milliseconds,
           format("  collision %.3f, contacts %.3f, solver %.3f", 1e3 * collision, 1e3 * contacts,
                  1e3 * solver));
  report.add({{"seconds_per_step/collision", collision},
              {"seconds_per_step/contacts", contacts},
              {"seconds_per_step/solver", solver}});
  report.add("contact_ratio", mean_of(results.records, &StepRecord::contact_ratio))
      .row("contact ratio", Unit::decimals, "  triangle pairs by triangles, mean");
  report.add("last/contacts", last.contacts).row("contacts", Unit::count, "  in the last step");
  report.add("last/penetration_max", last.penetration_max)
      .row("penetration", Unit::magnitude, "  in the last step");
  report.add("last/speed_max", last.speed_max)
      .row("speed", Unit::magnitude,
           format("  of the fastest body at the end; %.2e by turning", last.spin_max));
  report.add({{"last/spin_max", last.spin_max},
              {"last/residual_max", last.residual_max},
              {"last/kinetic_energy", last.kinetic_energy}});
  return report;
}

// Returns whether the run is there already: with --resume there is nothing left to do.
bool is_done(const SimulateArguments& arguments, const RunDescription& run) {
  if (!arguments.run.resume || !fs::exists(arguments.run.output)) return false;
  return read_run(arguments.run.output, run).records.size() == arguments.run.steps;
}

// Refuses options that the chosen solver would not look at.
void check_solver_options(const SimulateArguments& arguments) {
  const TestBedSolverOptions none, &given = arguments.simulator.solver;
  if (given.method == SolverMethod::sweeps) return;
  const auto refuse = [](bool is_given, const char* option) {
    if (is_given) throw UsageError(std::string(option) + " is of --solver sweeps");
  };
  refuse(given.iterations != none.iterations, "--iterations");
  refuse(given.position_iterations != none.position_iterations, "--position-iterations");
  refuse(given.order != none.order, "--order");
  refuse(given.shock_propagation, "--shock");
}

// Refuses options that a GPU would not look at.
void check_gpu_options(const SimulateArguments& arguments) {
  if (!arguments.on_gpu()) return;
  const auto refuse = [](bool is_given, const char* option) {
    if (is_given) throw UsageError(std::string(option) + " is for the backend cpu");
  };
  refuse(arguments.simulator.solver.method == SolverMethod::sweeps, "--solver sweeps");
  refuse(arguments.engine != SimulateArguments().engine, "--engine");
  refuse(arguments.fast, "--fast");
  refuse(arguments.ask_all, "--ask-all");
  refuse(arguments.cold, "--cold");
  refuse(arguments.told_threads.has_value() && !arguments.continuous, "--threads");
}

std::unique_ptr<BodyMover> make_mover(const SimulateArguments& arguments, const Start& start) {
  const SimulatorOptions& options = arguments.simulator;
  const auto& [bodies, states, findings, triangles] = start.bodies;
  if (arguments.on_gpu())
    return make_gpu_mover(start.shapes(), bodies, states, start.filter, options, arguments.continuous);
  auto engine = make_engine(arguments.engine,
                            ContactOptions{.mode = arguments.fast ? QueryMode::fast : QueryMode::exact});
  engine->set_filter(start.filter);
  std::unique_ptr<ContactsAhead> ahead;
  if (options.solver.method != SolverMethod::sweeps)
    ahead = std::make_unique<ContactsAhead>(start.shapes(), options.threads, &start.filter);
  std::unique_ptr<ContinuousMotion> continuous;
  if (arguments.continuous)
    continuous = std::make_unique<ContinuousMotion>(start.shapes(), options.threads, &start.filter);
  // World does the same.
  const bool is_world = arguments.engine == "tandem" && !arguments.fast && !arguments.ask_all;
  auto contacts = is_world ? make_scene_contacts(start.shapes(), options.threads, &start.filter)
                           : make_mesh_contact_finder(std::move(engine), start.shapes(),
                                                      options.threads.count(), arguments.ask_all);
  return std::make_unique<MovesBy<Simulator>>(bodies, states, std::move(contacts), options,
                                              std::move(continuous), std::move(ahead));
}

ExitCode run(const char* kind, SimulateArguments arguments, const SetUp& set_up) {
  check_solver_options(arguments);
  check_gpu_options(arguments);
  check_output(arguments, {arguments.mesh, arguments.ground, arguments.scene});
  arguments.run.output = arguments.output;
  Start start;
  set_up(arguments, start);
  keep_inputs(arguments.output, start.paths);
  keep_inputs(part_file(arguments.output), {arguments.scene});
  keep_inputs(part_file(arguments.output), start.paths);
  for (const std::string& finding : start.bodies.findings)
    std::fprintf(stderr, "bvhbench: %s\n", finding.c_str());
  SimulatorOptions& options = arguments.simulator;
  options.threads = arguments.threads();
  options.gravity = {0, 0, -arguments.gravity};
  options.solver.slop = slop_of(arguments, start.shapes(), start.bodies.bodies);
  options.solver.rolling_resistance =
      arguments.rolling_resistance >= 0 ? arguments.rolling_resistance : 16 * options.solver.slop;
  options.solver.warm_start = !arguments.cold;
  options.solver.seed = arguments.seed;
  if (options.solver.substeps == 0) options.solver.substeps = default_substeps(options.solver.method);
  const RunDescription description = describe(kind, arguments, start);
  if (is_done(arguments, description)) {
    std::printf("%s: is done\n", arguments.output.c_str());
    return kDone;
  }
  const auto mover = make_mover(arguments, start);
  const RunResults results = run_simulation(*mover, description, start.reentry, arguments.run);
  print(arguments, report_of(kind, arguments, description, results));
  return kDone;
}

std::string engine_defect(const std::string& name) {
  const auto names = engine_names();
  const std::string unknown = one_of({names.begin(), names.end()})(name);
  return unknown.empty() && !is_built_in(name) ? "this bvhbench was built without " + name : unknown;
}

// Seconds, also as a fraction such as 1/60.
std::optional<double> seconds_in(const std::string& text) {
  const std::size_t slash = text.find('/');
  if (slash == std::string::npos) return number_in(text);
  const auto part = number_in(text.substr(0, slash)), whole = number_in(text.substr(slash + 1));
  return part && whole && *whole != 0 ? std::optional(*part / *whole) : std::nullopt;
}

// A longer step has no meaning: bodies fall by metres in it.
std::string step_defect(const std::string& text) {
  constexpr double kLongest = 1;
  const double seconds = seconds_in(text).value_or(0);
  return seconds >= 1e-9 && seconds <= kLongest ? "" : "not a number or fraction from 1e-09 to 1";
}

void add_solver_options(Command command, SimulateArguments& arguments) {
  SimulatorOptions& simulator = arguments.simulator;
  TestBedSolverOptions& solver = simulator.solver;
  command.add(
      {{"--solver", solver.method, kSolvers, "auto|soft|newton|sweeps [auto]",
        "how a step is solved: 'soft' or 'newton', 'auto' of these two, or 'sweeps'"},
       {"--dt", [&simulator](const std::string& text) { simulator.dt = *seconds_in(text); }, "SECONDS [1/60]",
        "seconds of a step, as a number or a fraction", step_defect},
       {"--substeps", solver.substeps, "N [16, with sweeps 1]", "parts of a step that share its contacts",
        between(1, 10'000)},
       {"--iterations", solver.iterations, "N [30]", "sweeps for velocities in each part of a step",
        between(0, 1'000'000)},
       {"--position-iterations", solver.position_iterations, "N [30]",
        "sweeps for the correction of penetration in each part", between(0, 1'000'000)},
       {"--gravity", arguments.gravity, "G [9.81]", "along -z, in m/s^2", between(-1e6, 1e6)},
       {"--friction", solver.friction, format("MU [%g]", solver.friction), "coefficient of friction",
        between(0, 1e6)},
       {"--restitution", solver.restitution, "E [0]", "part of the speed that an impact gives back",
        between(0, 1)},
       {"--slop", arguments.slop, "S [1/4000 of a mesh's diagonal]",
        "penetration that is left alone, in metres", between(0, 1e6)},
       {"--rolling-resistance", arguments.rolling_resistance, "L [16 times the slop]",
        "lever at which the force between two bodies resists that they turn, in metres; not by sweeps",
        between(0, 1e6)},
       {"--correction", solver.correction, "B [0.2]",
        "part of the penetration beyond the slop that a step corrects", between(0, 1)},
       {"--order", solver.order, kOrders, "found|shuffled [found]",
        "in which contacts are solved: as 'found', or 'shuffled'"},
       {"--cold", arguments.cold, "start each step without the impulses of the step before"},
       {"--shock", solver.shock_propagation, "propagate shocks from the ground up after the sweeps"},
       {"--sleep", simulator.sleep.enabled, "let islands at rest fall asleep"},
       {"--continuous", arguments.continuous,
        "carry fast bodies to where they first meet others, so that none passes through"},
       {"--sleep-speed", simulator.sleep.speed, "V [0.01]", "below which a body is at rest, in m/s",
        between(0, 1e6)}});
}

void add_run_options(Command command, SimulateArguments& arguments) {
  RunOptions& run = arguments.run;
  command.add(
      {required({"--frames", run.steps, "N", "steps to make", between(1, 1'000'000'000)}),
       backend_option(arguments),
       {"--engine", arguments.engine, "NAME [tandem]", "what finds the triangles that meet", engine_defect},
       {"--fast", arguments.fast, "let the engine decide triangles in float32"},
       {"--ask-all", arguments.ask_all,
        "ask the engine about pairs that keep their contacts too; the results stay the same"},
       {"--density", arguments.density, "D [1000]", "of the bodies, in kg/m^3", between(1e-12, 1e12)},
       threads_option(arguments, "the results do"),
       {"--trajectory", run.trajectory_every, "K [0]", "keep the state after every K-th step; 0: none"},
       {"--checkpoint", run.checkpoint_seconds, "S [10]", "seconds between two writings of OUTPUT.part",
        between(0, 1e9)},
       {"--resume", run.resume, "go on from OUTPUT.part; nothing to do where OUTPUT is done"},
       json_option(arguments),
       required(
           output_option(arguments, "the run file to write; appears whole or not at all", "-o,--output"))});
}

// Adds the options that the paper's configurations have and scene files have not.
void add_configuration(Command command, SimulateArguments& arguments) {
  command.add({mesh_option(arguments.mesh), count_option(arguments.count, 1000),
               seed_option(arguments.seed, "another start of the kind; and of --order shuffled")});
}

}  // namespace

void add_simulate(Command tool, Run& run_later) {
  const Command simulate = tool.add_command("simulate", "let bodies move, and keep what that takes");
  simulate.require_command();
  const auto add = [&](const char* kind, const char* help, const SetUp& set_up, double friction = 0.5) {
    const auto added = add_command<SimulateArguments>(
        simulate, run_later, kind, help,
        [=](const SimulateArguments& told) { return run(kind, told, set_up); });
    added.second.simulator.solver.friction = friction;
    add_solver_options(added.first, added.second);
    add_run_options(added.first, added.second);
    return added;
  };

  const auto [slide, sliding] =
      add("slide", "rocks that slide down a tilted ground, again and again", set_up_slide, 0.4);
  add_configuration(slide, sliding);
  slide.add({ground_option(sliding.ground, "ground, which is fixed"),
             {"--tilt", sliding.tilt, "DEGREES [30]", "slope of the ground along x", between(0, 80)}});

  const auto [pile, falling] = add("pile", "bodies that fall on the ground and on each other", set_up_pile);
  add_configuration(pile, falling);
  pile.add({ground_option(falling.ground, "ground, which is fixed")});

  const auto [stack, standing] = add("stack", "a cube of boxes on a floor of boxes", set_up_stack);
  add_configuration(stack, standing);
  stack.check("--count", cube_defect);
  stack.add({{"--jitter", standing.jitter, "J [0.0005]",
              "how far boxes are moved along x and y at most, in box lengths", between(0, 0.1)}});

  const auto [scene, any] = add("scene", "the bodies of a scene file", set_up_scene);
  scene.add({scene_argument(any), seed_option(any.seed, "of --order shuffled")});
}

}  // namespace tandem::bench
