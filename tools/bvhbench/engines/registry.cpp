#include "registry.h"

#include <algorithm>

namespace tandem {

using Engines = std::unique_ptr<Engine>(const ContactOptions& options);
// Each in a file of its own.
Engines make_tandem, make_tandem_cuda, make_paper, make_paper_bits, make_fcl, make_embree, make_embree_refit,
    make_bullet, make_ode, make_cgal;

namespace {

struct Entry {
  std::string_view name;
  std::string_view peer;  // what compare calls it; empty: not compared
  bool simulates;         // all contacts are told, and right
  std::string_view needs;
  Engines* make;  // null where what it needs was not found
  bool has_modes = false;
};

constexpr Engines* where(bool found, Engines* make) {
  return found ? make : nullptr;
}

constexpr Entry kEntries[] = {
    {"tandem", "tandem", true, "", make_tandem, true},
    {"tandem-cuda", "", true, "CUDA", where(TANDEM_HAVE_CUDA, make_tandem_cuda), true},
    {"paper", "", true, "CUDA", where(TANDEM_HAVE_CUDA, make_paper), true},
    {"paper-bits", "", true, "CUDA", where(TANDEM_HAVE_CUDA, make_paper_bits), true},
    {"fcl", "fcl", true, "FCL", where(TANDEM_HAVE_FCL, make_fcl)},
    {"embree", "embree", true, "Embree 3", where(TANDEM_HAVE_EMBREE, make_embree)},
    {"embree-refit", "embree", true, "Embree 3", where(TANDEM_HAVE_EMBREE, make_embree_refit)},
    {"bullet", "bullet", false, "Bullet", where(TANDEM_HAVE_BULLET, make_bullet)},
    {"ode", "ode", false, "ODE", where(TANDEM_HAVE_ODE, make_ode)},
    {"cgal", "cgal", false, "", make_cgal},
};

const Entry* find_entry(std::string_view name) {
  const auto* found =
      std::find_if(std::begin(kEntries), std::end(kEntries), [&](const Entry& e) { return e.name == name; });
  return found == std::end(kEntries) ? nullptr : found;
}

std::string list_of_names() {
  std::string list;
  for (const std::string_view name : engine_names()) list += (list.empty() ? "" : ", ") + std::string(name);
  return list;
}

}  // namespace

std::vector<std::string_view> engine_names() {
  std::vector<std::string_view> names;
  for (const Entry& entry : kEntries) {
    if (entry.simulates) names.push_back(entry.name);
  }
  return names;
}

bool is_built_in(std::string_view name) {
  const Entry* entry = find_entry(name);
  return entry != nullptr && entry->make != nullptr;
}

std::unique_ptr<Engine> make_engine(std::string_view name, const ContactOptions& options) {
  const Entry* entry = find_entry(name);
  const std::string quoted(name);
  if (entry == nullptr) throw std::runtime_error("no engine " + quoted + ": there are " + list_of_names());
  if (entry->make == nullptr) {
    throw std::runtime_error("the engine " + quoted + " is not built in: " + std::string(entry->needs) +
                             " was not found when this program was built");
  }
  if (options.mode != QueryMode::exact && !entry->has_modes) {
    throw std::runtime_error("the engine " + quoted + " has no fast mode");
  }
  return entry->make(options);
}

DistancesOnGpu* distances_on_gpu() {
  constexpr DistancesOnGpu* kFound = TANDEM_HAVE_CUDA ? time_distances_on_gpu : nullptr;
  return kFound;
}

ImpactsOnGpu* impacts_on_gpu() {
  constexpr ImpactsOnGpu* kFound = TANDEM_HAVE_CUDA ? time_impacts_on_gpu : nullptr;
  return kFound;
}

VerdictsOnGpu* verdicts_on_gpu() {
  constexpr VerdictsOnGpu* kFound = TANDEM_HAVE_CUDA ? time_verdicts_on_gpu : nullptr;
  return kFound;
}

std::vector<std::string_view> peer_names() {
  std::vector<std::string_view> names;
  for (const Entry& entry : kEntries) {
    if (entry.peer.empty() || entry.make == nullptr) continue;
    if (names.empty() || names.back() != entry.peer) names.push_back(entry.peer);
  }
  return names;
}

std::vector<std::unique_ptr<Engine>> make_peers(std::string_view peer) {
  std::vector<std::unique_ptr<Engine>> peers;
  for (const Entry& entry : kEntries) {
    if (entry.peer != peer || entry.make == nullptr) continue;
    for (const QueryMode mode : {QueryMode::exact, QueryMode::fast, QueryMode::boxes}) {
      if (mode == QueryMode::exact || entry.has_modes) peers.push_back(entry.make({.mode = mode}));
    }
  }
  return peers;
}

}  // namespace tandem
