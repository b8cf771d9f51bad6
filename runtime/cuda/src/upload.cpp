#include "tandem/runtime/upload.h"

#include <utility>

#include "tandem/formats/gpu_status.h"

namespace tandem {
namespace {

// Bytes of a file: `size` from `begin` on.
struct Range {
  std::uint64_t begin, size;
};

Range all_of(const AssetView& asset) {
  return {0, asset.header->file_bytes};
}

// From the first section that exact queries need to the last. A checked file's sections ascend.
Range of_exact_queries(const AssetView& asset) {
  Range range = {};
  for (const Section& section : asset.sections) {
    if (section.kind != SectionKind::triangles && section.kind != SectionKind::oriented_blocks) continue;
    if (range.size == 0) range.begin = section.offset;
    range.size = section.offset + section.bytes - range.begin;
  }
  return range;
}

// The same place of the copy of a range; null where it is not in the range.
template <typename Element>
const Element* relocate(const Element* element, const void* file, const Range& range, const void* copy) {
  if (element == nullptr) return nullptr;
  const auto offset = reinterpret_cast<std::uintptr_t>(element) - reinterpret_cast<std::uintptr_t>(file);
  if (offset < range.begin || offset - range.begin >= range.size) return nullptr;
  return reinterpret_cast<const Element*>(static_cast<const char*>(copy) + (offset - range.begin));
}

}  // namespace

DeviceAsset& DeviceAsset::operator=(DeviceAsset&& other) noexcept {
  data_ = std::move(other.data_);
  std::swap(level_count_, other.level_count_);
  std::swap(levels_, other.levels_);
  std::swap(error_, other.error_);
  return *this;
}

Status DeviceAsset::upload(const AssetView& asset, cudaStream_t stream, Contents contents) {
  free();
  const auto* const file = reinterpret_cast<const unsigned char*>(asset.header);
  const Range range = contents == Contents::all ? all_of(asset) : of_exact_queries(asset);
  error_ = data_.upload({file + range.begin, range.size}, stream);
  if (error_ != cudaSuccess) {
    data_.free();
    return status_of(error_);
  }
  level_count_ = static_cast<std::uint32_t>(asset.levels.size());
  for (std::uint32_t i = 0; i < level_count_; ++i) {
    levels_[i] = asset.level(i);
    LevelView& level = levels_[i];
    level.triangles = relocate(level.triangles, file, range, data_.data());
    level.oriented_blocks = relocate(level.oriented_blocks, file, range, data_.data());
    level.blocks = contents == Contents::all ? relocate(level.blocks, file, range, data_.data()) : nullptr;
  }
  return Status::kOk;
}

void DeviceAsset::free() {
  data_.free();
  level_count_ = 0;
  error_ = cudaSuccess;
}

}  // namespace tandem
