#include <algorithm>
#include <stdexcept>

#include "engine_parts.h"
#include "peer.h"

namespace tandem::simulation {
namespace {

#ifdef TANDEM_BENCH_CUDA
constexpr bool kHaveCuda = true;
#else
constexpr bool kHaveCuda = false;
#endif

enum class Needs : std::uint8_t { nothing, cuda, fcl, embree };

struct Engine {
  std::string_view name;
  Needs needs;
  const char* missing;  // why it is not there, where it is not
  bool has_fast;
};

constexpr Engine kEngines[] = {
    {"tandem", Needs::nothing, "", true},
    {"tandem-cuda", Needs::cuda, "CUDA was not found", true},
    {"paper", Needs::cuda, "CUDA was not found", true},
    {"paper-bits", Needs::cuda, "CUDA was not found", true},
    {"fcl", Needs::fcl, "FCL was not found", false},
    {"embree", Needs::embree, "Embree 3 was not found", false},
    {"embree-refit", Needs::embree, "Embree 3 was not found", false},
};

bool there_is(Needs needs) {
  const auto has_peer = [](std::string_view library) {
    const std::vector<std::string_view> there = bench::engines();
    return std::find(there.begin(), there.end(), library) != there.end();
  };
  switch (needs) {
    case Needs::cuda:
      return kHaveCuda;
    case Needs::fcl:
      return has_peer("fcl");
    case Needs::embree:
      return has_peer("embree");
    default:
      return true;
  }
}

const Engine* find_engine(std::string_view name) {
  const auto* found =
      std::find_if(std::begin(kEngines), std::end(kEngines), [&](const Engine& e) { return e.name == name; });
  return found == std::end(kEngines) ? nullptr : found;
}

std::string list_of_names() {
  std::string list;
  for (const Engine& engine : kEngines) list += (list.empty() ? "" : ", ") + std::string(engine.name);
  return list;
}

}  // namespace

std::vector<std::string_view> engine_names() {
  std::vector<std::string_view> names;
  for (const Engine& engine : kEngines) names.push_back(engine.name);
  return names;
}

bool is_built_in(std::string_view name) {
  const Engine* engine = find_engine(name);
  return engine != nullptr && there_is(engine->needs);
}

std::unique_ptr<CollisionEngine> make_engine(std::string_view name, const EngineOptions& options) {
  const Engine* engine = find_engine(name);
  const std::string quoted(name);
  if (engine == nullptr) throw std::runtime_error("no engine " + quoted + ": there are " + list_of_names());
  if (!there_is(engine->needs)) {
    throw std::runtime_error("the engine " + quoted + " is not built in: " + engine->missing +
                             " when this program was built");
  }
  if (options.fast && !engine->has_fast) {
    throw std::runtime_error("the engine " + quoted + " has no fast mode");
  }
  switch (engine->needs) {
    case Needs::cuda:
      if constexpr (kHaveCuda) return make_gpu_engine(engine->name, options);
      throw std::logic_error("an engine that is not there");
    case Needs::fcl:
      return make_peer_engine(engine->name, "fcl", 0);
    case Needs::embree:
      return make_peer_engine(engine->name, "embree", engine->name == "embree" ? 0 : 1);
    default:
      return make_tandem_engine(options);
  }
}

}  // namespace tandem::simulation
