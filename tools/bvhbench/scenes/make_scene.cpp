#include "make_scene.h"

#include <new>
#include <stdexcept>

#include "tandem/kernels/broad_phase.h"
#include "tandem/kernels/world_box.h"

namespace tandem::bench {

void move(std::vector<Instance>& instances, const Vector& offset) {
  for (Instance& instance : instances) {
    for (int k = 0; k < 3; ++k) instance.pose.translation[k] += offset[k];
  }
}

std::uint32_t root_above(std::uint32_t count, int power) {
  const auto enough = [&](std::uint64_t n) { return (power == 2 ? n * n : n * n * n) >= count; };
  std::uint32_t n = 1;
  while (!enough(n)) ++n;
  return n;
}

std::vector<ObjectPair> find_box_pairs(const std::vector<AssetView>& assets,
                                       const std::vector<Instance>& instances, const PairFilter& filter) {
  std::vector<WorldBox> boxes;
  boxes.reserve(instances.size());
  for (const Instance& instance : instances) {
    const FileHeader& header = *assets[instance.asset].header;
    boxes.push_back(
        world_box(for_stored_coordinates(instance.pose, header.origin), header.lower, header.upper));
  }
  BroadPhase broad_phase;
  const Status status = broad_phase.find_pairs(boxes, filter);
  if (status == Status::kOutOfMemory) throw std::bad_alloc();
  if (status != Status::kOk) throw std::runtime_error(explain(status));
  return {broad_phase.pairs().begin(), broad_phase.pairs().end()};
}

}  // namespace tandem::bench
