#include "tandem/runtime/upload.h"

#include <new>
#include <thread>
#include <utility>

#include "staged_copy.h"
#include "tandem/formats/gpu_status.h"

namespace tandem {
namespace {

// Returns the same place in the copy, null where no piece has it.
template <typename Element>
const Element* relocate(const Element* element, std::span<const Piece> pieces, const unsigned char* copy) {
  const auto at = reinterpret_cast<std::uintptr_t>(element);
  for (const Piece& piece : pieces) {
    const auto from = reinterpret_cast<std::uintptr_t>(piece.from);
    if (at >= from && at - from < piece.bytes)
      return reinterpret_cast<const Element*>(copy + piece.offset + (at - from));
  }
  return nullptr;
}

LevelView copied_level(LevelView level, std::span<const Piece> pieces, Contents contents,
                       const unsigned char* copy) {
  const auto copied = [&](auto*& elements, SectionKind kind) {
    elements = is_wanted(kind, contents) ? relocate(elements, pieces, copy) : nullptr;
  };
  copied(level.blocks, SectionKind::blocks);
  copied(level.triangles, SectionKind::triangles);
  copied(level.oriented_blocks, SectionKind::oriented_blocks);
  copied(level.topology, SectionKind::topology);
  copied(level.components, SectionKind::components);
  copied(level.source_vertices, SectionKind::source_vertices);
  return level;
}

template <typename Element>
std::unique_ptr<Element[]> array_of(std::size_t count) {
  return std::unique_ptr<Element[]>(new (std::nothrow) Element[count]);
}

// Makes one allocation for all pieces and copies them to it.
cudaError_t copy_to(GpuArray<unsigned char>& data, std::span<Piece> pieces, cudaStream_t stream) {
  const std::uint64_t bytes = place(pieces);
  const cudaError_t error = data.reserve(bytes);
  if (error != cudaSuccess) return error;
  const Staging staging = staging_of(bytes, std::thread::hardware_concurrency());
  return copy_pieces(pieces, bytes, staging, data.data(), stream);
}

}  // namespace

DeviceAssets& DeviceAssets::operator=(DeviceAssets&& other) noexcept {
  data_ = std::move(other.data_);
  std::swap(count_, other.count_);
  std::swap(first_level_, other.first_level_);
  std::swap(levels_, other.levels_);
  std::swap(error_, other.error_);
  return *this;
}

Status DeviceAssets::upload(std::span<const AssetView> assets, Contents contents, cudaStream_t stream) {
  free();
  std::size_t levels = 0, piece_count = 0;
  for (const AssetView& asset : assets) {
    levels += asset.levels.size();
    for_each_piece(asset, contents, [&](const Piece&) { ++piece_count; });
  }
  const std::unique_ptr<Piece[]> pieces = array_of<Piece>(piece_count);
  first_level_ = array_of<std::size_t>(assets.size());
  levels_ = array_of<LevelView>(levels);
  if (pieces == nullptr || first_level_ == nullptr || levels_ == nullptr) {
    free();
    return Status::kOutOfMemory;
  }
  Piece* next = pieces.get();
  for (const AssetView& asset : assets)
    for_each_piece(asset, contents, [&](const Piece& piece) { *next++ = piece; });
  const cudaError_t error = copy_to(data_, {pieces.get(), piece_count}, stream);
  if (error != cudaSuccess) {
    free();
    error_ = error;
    return status_of(error);
  }
  std::size_t level = 0;
  const Piece* own = pieces.get();
  for (; count_ < assets.size(); ++count_) {
    const AssetView& asset = assets[count_];
    std::size_t own_count = 0;
    for_each_piece(asset, contents, [&](const Piece&) { ++own_count; });
    first_level_[count_] = level;
    for (std::uint32_t i = 0; i < asset.levels.size(); ++i)
      levels_[level++] = copied_level(asset.level(i), {own, own_count}, contents, data_.data());
    own += own_count;
  }
  return Status::kOk;
}

void DeviceAssets::free() {
  *this = DeviceAssets();
}

}  // namespace tandem
