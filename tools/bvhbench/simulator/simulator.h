#pragma once
#include <cstdint>
#include <memory>
#include <vector>

#include "bvhbench/engines/engine.h"
#include "dynamics/continuous_motion.h"
#include "dynamics/simulation.h"

/// The test-bed: the library's simulation with any engine's contacts, and with the literature's sweeps.
namespace tandem::simulation {

using namespace dynamics;

/// Says how a step is solved.
enum class SolverMethod : std::uint8_t {
  automatic,  ///< as SolverKind
  soft,
  newton,
  sweeps,  ///< projected Gauss-Seidel
};

/// Says in which order sweeps visit contacts.
enum class ContactOrder : std::uint8_t {
  found,     ///< by ascending pair of bodies, sweeps forwards and backwards in turn
  shuffled,  ///< anew in each step, from the seed
};

/// The library's options and those of sweeps, which have no rolling resistance.
struct TestBedSolverOptions : dynamics::SolverOptions {
  SolverMethod method = SolverMethod::automatic;

  // These are for sweeps alone.
  std::uint32_t iterations = 30;           ///< sweeps over the contacts for velocities, at most
  std::uint32_t position_iterations = 30;  ///< the same for the correction of penetration
  ContactOrder order = ContactOrder::found;
  std::uint64_t seed = 1;
  bool shock_propagation = false;

  TestBedSolverOptions() { substeps = 0; }  ///< 0: default_substeps()
};

/// The parts of a step where options say nothing: 1 for sweeps, 16 for the others.
std::uint32_t default_substeps(SolverMethod method);

struct SimulatorOptions : SimulationOptions {
  TestBedSolverOptions solver;  ///< in place of the library's
};

/// Returns the library's options, whose solver is the soft one for sweeps.
SimulationOptions options_of(const SimulatorOptions& options);

/// The solver of a method.
std::unique_ptr<StepSolver> make_solver(const TestBedSolverOptions& options);

/// The solver of SolverMethod::sweeps.
std::unique_ptr<StepSolver> make_sweep_solver(const TestBedSolverOptions& options);

/// The library's simulation with the test-bed's solvers. With warm start, sweeps make ten times as many in a
/// step that has no impulse of the step before.
class Simulator : public Simulation {
 public:
  /// Conditions: as of Simulation.
  Simulator(std::vector<BodyProperties> bodies, std::vector<BodyState> states,
            std::unique_ptr<ContactFinder> contacts, const SimulatorOptions& options,
            std::unique_ptr<ContinuousMotion> continuous = nullptr,
            std::unique_ptr<ContactsAhead> ahead = nullptr);
};

/// Contacts of meshes: a collision engine finds the triangles that meet, and points are made of them. What
/// the shapes look at must outlive it. asks_all: the engine is asked about pairs that are kept too, so that
/// its times and counters are of all pairs. Throws EngineError.
std::unique_ptr<ContactFinder> make_mesh_contact_finder(std::unique_ptr<Engine> engine,
                                                        std::span<const AssetView> shapes,
                                                        std::uint32_t threads, bool asks_all = false);

/// An engine's error of a failed question.
EngineError error_of(const QueryFailed& failed, const char* question);

}  // namespace tandem::simulation
