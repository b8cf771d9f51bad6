#include "dynamics/elimination_order.h"

#include <algorithm>
#include <iterator>
#include <set>
#include <utility>

namespace tandem::dynamics {

std::optional<std::vector<std::uint32_t>> elimination_order(std::size_t bodies,
                                                            std::span<const ObjectPair> links, double most) {
  constexpr double kBlockProduct = 216;
  std::vector<std::vector<std::uint32_t>> beside(bodies);
  for (const ObjectPair& link : links) {
    beside[link.a].push_back(link.b);
    beside[link.b].push_back(link.a);
  }
  std::set<std::pair<std::size_t, std::uint32_t>> queue;  // by degree
  for (std::uint32_t i = 0; i < bodies; ++i) {
    std::sort(beside[i].begin(), beside[i].end());
    beside[i].erase(std::unique(beside[i].begin(), beside[i].end()), beside[i].end());
    queue.emplace(beside[i].size(), i);
  }
  std::vector<std::uint32_t> order, joined;
  double work = 0;
  while (!queue.empty()) {
    const std::uint32_t next = queue.begin()->second;
    queue.erase(queue.begin());
    const std::vector<std::uint32_t>& around = beside[next];
    const auto degree = static_cast<double>(around.size());
    work += kBlockProduct * 0.5 * (degree + 1) * (degree + 2);
    if (work > most) return {};
    for (const std::uint32_t other : around) {
      std::vector<std::uint32_t>& theirs = beside[other];
      queue.erase({theirs.size(), other});
      joined.clear();
      std::set_union(theirs.begin(), theirs.end(), around.begin(), around.end(), std::back_inserter(joined));
      std::erase_if(joined, [&](std::uint32_t body) { return body == next || body == other; });
      theirs = joined;
      queue.emplace(theirs.size(), other);
    }
    order.push_back(next);
  }
  return order;
}

}  // namespace tandem::dynamics
