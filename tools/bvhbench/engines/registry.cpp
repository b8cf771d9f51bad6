#include "registry.h"

#include <algorithm>

namespace tandem {

using Maker = std::unique_ptr<Engine>(std::string_view name, const Question& question);
// Each maker is in a file of its own.
Maker make_tandem, make_tandem_cuda, make_paper, make_fcl, make_coal, make_embree, make_bullet, make_ode,
    make_cgal;

namespace {

// Questions that an engine answers: bits by the place of their options in Question.
enum : unsigned { kContacts = 1, kDistances = 2, kImpacts = 4, kVerdicts = 8, kProbes = 16, kOfPairs = 15 };

// An engine that compare does not run has no library. Engines that simulate find all contacts, and the right
// ones.
enum class Use : std::uint8_t { compares, simulates };

struct Entry {
  std::string_view name;
  std::string_view library;  // what compare calls it; empty: not compared
  unsigned questions;
  Use use;
  std::string_view needs;
  Maker* make;  // null where what it needs was not found
  bool has_modes = false;
  bool deforms = false;

  bool answers(const Question& question) const { return (questions >> question.index() & 1u) != 0; }
};

constexpr Maker* where(bool found, Maker* make) {
  return found ? make : nullptr;
}

constexpr auto kSimulates = Use::simulates, kCompares = Use::compares;
constexpr Maker *kTandemCuda = where(TANDEM_HAVE_CUDA, make_tandem_cuda),
                *kPaper = where(TANDEM_HAVE_CUDA, make_paper), *kFcl = where(TANDEM_HAVE_FCL, make_fcl),
                *kCoal = where(TANDEM_HAVE_COAL, make_coal),
                *kEmbree = where(TANDEM_HAVE_EMBREE, make_embree),
                *kBullet = where(TANDEM_HAVE_BULLET, make_bullet), *kOde = where(TANDEM_HAVE_ODE, make_ode);

constexpr Entry kEntries[] = {
    {"tandem", "tandem", kOfPairs | kProbes, kSimulates, "", make_tandem, true, true},
    {"tandem-cuda", "", kOfPairs, kSimulates, "CUDA", kTandemCuda, true, true},
    {"paper", "", kContacts, kSimulates, "CUDA", kPaper, true},
    {"paper-bits", "", kContacts, kSimulates, "CUDA", kPaper, true},
    {"fcl", "fcl", kContacts, kSimulates, "FCL", kFcl, false, true},
    {"fcl-rss", "fcl", kDistances, kCompares, "FCL", kFcl},
    {"fcl-obbrss", "fcl", kDistances, kCompares, "FCL", kFcl},
    {"fcl-oriented", "fcl", kImpacts, kCompares, "FCL", kFcl},
    {"fcl-10-poses", "fcl", kImpacts, kCompares, "FCL", kFcl},
    {"fcl-100-poses", "fcl", kImpacts, kCompares, "FCL", kFcl},
    {"fcl-public", "fcl", kImpacts, kCompares, "FCL", kFcl},
    {"coal-rss", "coal", kDistances, kCompares, "Coal", kCoal},
    {"coal-obbrss", "coal", kDistances, kCompares, "Coal", kCoal},
    {"embree", "embree", kContacts | kProbes, kSimulates, "Embree 3", kEmbree, false, true},
    {"embree-refit", "embree", kContacts, kSimulates, "Embree 3", kEmbree, false, true},
    {"bullet", "bullet", kContacts, kCompares, "Bullet", kBullet, false, true},
    {"ode", "ode", kContacts, kCompares, "ODE", kOde},
    {"cgal", "cgal", kContacts | kDistances, kCompares, "", make_cgal},
};

bool is_compared(const Entry& entry, const Question& question) {
  return !entry.library.empty() && entry.make != nullptr && entry.answers(question);
}

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
    if (entry.use == kSimulates) names.push_back(entry.name);
  }
  return names;
}

std::vector<std::string_view> deforming_engine_names() {
  std::vector<std::string_view> names;
  for (const Entry& entry : kEntries) {
    if (entry.deforms && entry.make != nullptr) names.push_back(entry.name);
  }
  return names;
}

bool is_built_in(std::string_view name) {
  const Entry* entry = find_entry(name);
  return entry != nullptr && entry->make != nullptr;
}

std::unique_ptr<Engine> make_engine(std::string_view name, const Question& question) {
  const Entry* entry = find_entry(name);
  const std::string quoted(name);
  if (entry == nullptr) throw std::runtime_error("no engine " + quoted + ": there are " + list_of_names());
  if (entry->make == nullptr) {
    throw std::runtime_error("the engine " + quoted + " is not built in: " + std::string(entry->needs) +
                             " was not found when this program was built");
  }
  if (!entry->answers(question))
    throw std::runtime_error("the engine " + quoted + " does not answer this question");
  const auto* contacts = std::get_if<ContactOptions>(&question);
  if (contacts != nullptr && contacts->mode != QueryMode::exact && !entry->has_modes) {
    throw std::runtime_error("the engine " + quoted + " has no fast mode");
  }
  return entry->make(entry->name, question);
}

std::vector<std::string_view> peer_names() {
  std::vector<std::string_view> names;
  for (const Entry& entry : kEntries) {
    if (!is_compared(entry, ContactOptions())) continue;
    if (names.empty() || names.back() != entry.library) names.push_back(entry.library);
  }
  return names;
}

std::vector<std::unique_ptr<Engine>> make_peers(const Question& question,
                                                const std::vector<std::string>& libraries) {
  std::vector<std::unique_ptr<Engine>> peers;
  for (const Entry& entry : kEntries) {
    if (!is_compared(entry, question)) continue;
    if (!libraries.empty() && std::find(libraries.begin(), libraries.end(), entry.library) == libraries.end())
      continue;
    peers.push_back(entry.make(entry.name, question));
    if (!entry.has_modes || !std::holds_alternative<ContactOptions>(question)) continue;
    for (const QueryMode mode : {QueryMode::fast, QueryMode::boxes})
      peers.push_back(entry.make(entry.name, ContactOptions{.mode = mode}));
  }
  return peers;
}

}  // namespace tandem
