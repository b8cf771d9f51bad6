#include "tandem/runtime/upload.h"

#include <new>
#include <thread>
#include <utility>

#include "staged_copy.h"
#include "tandem/formats/gpu_status.h"

namespace tandem {
namespace {

const unsigned char* bytes_of(const AssetView& asset) {
  return reinterpret_cast<const unsigned char*>(asset.header);
}

bool is_wanted(SectionKind kind, Contents contents) {
  switch (kind) {
    case SectionKind::triangles:
    case SectionKind::oriented_blocks:
      return true;
    case SectionKind::topology:
    case SectionKind::components:
      return contents != Contents::exact_queries;
    default:
      return contents == Contents::all;
  }
}

// From the first section that is wanted to the last. A checked file's sections ascend.
Piece of_wanted(const AssetView& asset, Contents contents) {
  std::uint64_t begin = 0, end = 0;
  for (const Section& section : asset.sections) {
    if (!is_wanted(section.kind, contents)) continue;
    if (end == 0) begin = section.offset;
    end = section.offset + section.bytes;
  }
  return {bytes_of(asset) + begin, end - begin, 0};
}

Piece piece_of(const AssetView& asset, Contents contents) {
  if (contents == Contents::all) return {bytes_of(asset), asset.header->file_bytes, 0};
  return of_wanted(asset, contents);
}

// The same place of the copy of a piece; null where it is not in the piece.
template <typename Element>
const Element* relocate(const Element* element, const Piece& piece, const unsigned char* copy) {
  const auto at = reinterpret_cast<std::uintptr_t>(element),
             from = reinterpret_cast<std::uintptr_t>(piece.from);
  if (element == nullptr || at < from || at - from >= piece.bytes) return nullptr;
  return reinterpret_cast<const Element*>(copy + piece.offset + (at - from));
}

LevelView copied_level(LevelView level, const Piece& piece, Contents contents, const unsigned char* copy) {
  const auto copied = [&](auto*& elements, SectionKind kind) {
    elements = is_wanted(kind, contents) ? relocate(elements, piece, copy) : nullptr;
  };
  copied(level.blocks, SectionKind::blocks);
  copied(level.triangles, SectionKind::triangles);
  copied(level.oriented_blocks, SectionKind::oriented_blocks);
  copied(level.topology, SectionKind::topology);
  copied(level.components, SectionKind::components);
  return level;
}

template <typename Element>
std::unique_ptr<Element[]> array_of(std::size_t count) {
  return std::unique_ptr<Element[]>(new (std::nothrow) Element[count]);
}

// One allocation for all.
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
  std::size_t levels = 0;
  for (const AssetView& asset : assets) levels += asset.levels.size();
  const std::unique_ptr<Piece[]> pieces = array_of<Piece>(assets.size());
  first_level_ = array_of<std::size_t>(assets.size());
  levels_ = array_of<LevelView>(levels);
  if (pieces == nullptr || first_level_ == nullptr || levels_ == nullptr) {
    free();
    return Status::kOutOfMemory;
  }
  for (std::size_t i = 0; i < assets.size(); ++i) pieces[i] = piece_of(assets[i], contents);
  const cudaError_t error = copy_to(data_, {pieces.get(), assets.size()}, stream);
  if (error != cudaSuccess) {
    free();
    error_ = error;
    return status_of(error);
  }
  std::size_t level = 0;
  for (; count_ < assets.size(); ++count_) {
    first_level_[count_] = level;
    for (std::uint32_t i = 0; i < assets[count_].levels.size(); ++i)
      levels_[level++] = copied_level(assets[count_].level(i), pieces[count_], contents, data_.data());
  }
  return Status::kOk;
}

void DeviceAssets::free() {
  *this = DeviceAssets();
}

}  // namespace tandem
