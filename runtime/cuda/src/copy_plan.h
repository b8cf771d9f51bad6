#pragma once
#include <algorithm>
#include <cstdint>
#include <span>

#include "tandem/formats/view.h"
#include "tandem/runtime/contents.h"

// The plan of a copy: what is copied of files, where it lies in one copy of them all, and who copies it.
// Measured: docs/decisions/gpu-blocks.md.
namespace tandem {

/// Bytes in CPU memory and their place in the copy.
struct Piece {
  const unsigned char* from;
  std::uint64_t bytes;
  std::uint64_t offset;  ///< in the copy, a multiple of kSectionAlignment
};

constexpr bool is_wanted(SectionKind kind, Contents contents) {
  switch (kind) {
    case SectionKind::triangles:
    case SectionKind::oriented_blocks:
      return true;
    case SectionKind::topology:
    case SectionKind::components:
    case SectionKind::source_vertices:
      return contents != Contents::exact_queries;
    case SectionKind::blocks:
      return contents == Contents::all;
    default:
      return false;
  }
}

/// Calls add(piece) for what of the file is to be copied, in the order of the file: sections that follow one
/// another make one piece.
template <typename Add>
void for_each_piece(const AssetView& asset, Contents contents, const Add& add) {
  const auto* bytes = reinterpret_cast<const unsigned char*>(asset.header);
  if (contents == Contents::all && asset.levels.size() == asset.header->level_count)
    return add(Piece{bytes, asset.header->file_bytes, 0});
  std::uint64_t begin = 0, end = 0;  // of the piece in the making
  for (const Section& section : asset.sections) {
    const bool shown =
        section.level >= asset.first_level && section.level - asset.first_level < asset.levels.size();
    if (shown && is_wanted(section.kind, contents)) {
      if (end == 0) begin = section.offset;
      end = section.offset + section.bytes;
    } else if (end != 0) {
      add(Piece{bytes + begin, end - begin, 0});
      end = 0;
    }
  }
  if (end != 0) add(Piece{bytes + begin, end - begin, 0});
}

/// Places the pieces one behind the other; returns the bytes of the copy.
inline std::uint64_t place(std::span<Piece> pieces) {
  std::uint64_t end = 0;
  for (Piece& piece : pieces) {
    piece.offset = (end + kSectionAlignment - 1) / kSectionAlignment * kSectionAlignment;
    end = piece.offset + piece.bytes;
  }
  return end;
}

/// Calls copy(from, bytes, offset) for what of each piece lies in the bytes [begin, end) of the copy.
/// Condition: the pieces are placed.
template <typename Copy>
void for_each_part(std::span<const Piece> pieces, std::uint64_t begin, std::uint64_t end, const Copy& copy) {
  const auto ends_behind = [](std::uint64_t at, const Piece& piece) {
    return at < piece.offset + piece.bytes;
  };
  auto piece = std::upper_bound(pieces.begin(), pieces.end(), begin, ends_behind);
  for (; piece != pieces.end() && piece->offset < end; ++piece) {
    const std::uint64_t first = std::max(begin, piece->offset),
                        last = std::min(end, piece->offset + piece->bytes);
    copy(piece->from + (first - piece->offset), last - first, first);
  }
}

/// Threads that copy into pinned memory, from which the GPU copies chunk by chunk; each has room for two.
struct Staging {
  std::uint32_t threads;  ///< kMostStagingThreads at most; 0: CUDA copies from pageable memory
  std::uint64_t chunk_bytes;
};

inline constexpr std::uint32_t kMostStagingThreads = 8;

/// The staging that is fastest. Pinning memory takes 0.36 ms a MB, so a thread pays only where it has 64 MiB
/// to copy, and one thread alone copies slower than CUDA.
inline Staging staging_of(std::uint64_t bytes, std::uint32_t cores) {
  constexpr std::uint64_t kChunk = std::uint64_t{2} << 20, kShare = std::uint64_t{64} << 20;
  const auto threads = static_cast<std::uint32_t>(
      std::min<std::uint64_t>(bytes / kShare, std::min(cores, kMostStagingThreads)));
  return {threads < 2 ? 0 : threads, kChunk};
}

}  // namespace tandem
