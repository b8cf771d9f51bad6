#include "peer.h"

namespace tandem::bench {
namespace {

struct Engine {
  std::string_view name;
  std::vector<std::unique_ptr<Peer>> (*make)();
};

constexpr Engine kEngines[] = {
    {"tandem", make_tandem_peers},
#ifdef TANDEM_HAVE_FCL
    {"fcl", make_fcl_peers},
#endif
#ifdef TANDEM_HAVE_EMBREE
    {"embree", make_embree_peers},
#endif
#ifdef TANDEM_HAVE_BULLET
    {"bullet", make_bullet_peers},
#endif
#ifdef TANDEM_HAVE_ODE
    {"ode", make_ode_peers},
#endif
    {"cgal", make_cgal_peers},
};

}  // namespace

std::vector<std::string_view> engines() {
  std::vector<std::string_view> names;
  for (const Engine& engine : kEngines) names.push_back(engine.name);
  return names;
}

std::vector<std::unique_ptr<Peer>> make_peers(std::string_view name) {
  for (const Engine& engine : kEngines) {
    if (engine.name == name) return engine.make();
  }
  return {};
}

}  // namespace tandem::bench
