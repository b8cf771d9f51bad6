#include "self_contacts.h"

#include <algorithm>
#include <new>

#include "tandem/kernels/contact_query.h"

namespace tandem::build {
namespace {

bool share_a_corner(const Triangle& a, const Triangle& b) {
  for (const Triangle::Corner& p : a.corner) {
    for (const Triangle::Corner& q : b.corner) {
      if (std::equal(p.position, p.position + 3, q.position)) return true;
    }
  }
  return false;
}

}  // namespace

std::optional<std::uint64_t> count_self_contacts(const AssetView& asset, std::uint32_t threads) {
  ContactQuery query;
  QueryOptions options;
  options.threads = std::min(threads, kMostQueryThreads);
  Instance instance = {0, kIdentityPose};
  for (int k = 0; k < 3; ++k) instance.pose.translation[k] = -asset.header->origin[k];
  const ObjectPair itself = {0, 0};
  Status status = query.set_assets({&asset, 1});
  if (status == Status::kOk) status = query.find_contacts({&instance, 1}, {&itself, 1}, options);
  if (status == Status::kOutOfMemory) throw std::bad_alloc();
  if (status != Status::kOk) return std::nullopt;
  const Triangle* triangles = asset.level().triangles;
  return static_cast<std::uint64_t>(
      std::count_if(query.contacts().begin(), query.contacts().end(), [&](const Contact& contact) {
        return !share_a_corner(triangles[contact.triangle_a], triangles[contact.triangle_b]);
      }));
}

}  // namespace tandem::build
