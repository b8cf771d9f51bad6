// The checker must tell sound files from all others without reading a byte outside of them, and what it calls
// sound must hold what its documentation promises.
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <new>
#include <random>
#include <string_view>
#include <vector>

#include "build/level_oracle.h"
#include "tandem/formats/check.h"

namespace {

using namespace tandem;

void demand(bool holds, const char* promise) {
  if (holds) return;
  std::fprintf(stderr, "a file that the checker calls sound breaks a promise: %s\n", promise);
  std::abort();
}

// A copy in an allocation of exactly its size, aligned as the checker wants.
class Bytes {
 public:
  Bytes(const std::uint8_t* data, std::size_t size)
      : data_(static_cast<std::uint8_t*>(::operator new (size, std::align_val_t{128}))), size_(size) {
    if (size != 0) std::memcpy(data_, data, size);
  }
  ~Bytes() { ::operator delete (data_, std::align_val_t{128}); }
  Bytes(const Bytes&) = delete;
  Bytes& operator=(const Bytes&) = delete;

  CheckResult check(CheckDepth depth = CheckDepth::full) const { return tandem::check(data_, size_, depth); }

  // Makes the hash and all before it right, so that the checker goes on to what lies behind.
  void disguise() {
    auto& header = *reinterpret_cast<FileHeader*>(data_);
    std::memcpy(header.magic, kMagic, sizeof kMagic);
    header.byte_order = kByteOrder;
    header.version_major = kVersionMajor;
    header.version_minor = kVersionMinor;
    header.file_bytes = size_;
    seal(data_, size_);
  }

 private:
  std::uint8_t* data_;
  std::size_t size_;
};

void read_triangle(const AssetView& asset, const Triangle& triangle) {
  for (const Triangle::Corner& corner : triangle.corner) {
    for (const float x : corner.position) demand(std::isfinite(x), "coordinates are finite");
  }
  demand(triangle.source_face() < asset.header->source_faces, "source faces are in range");
  demand(triangle.part() < asset.parts.size(), "parts are in range");
}

// Follows every node from the root, depth first; ends because each block must lie behind the one before it.
void walk(const AssetView& asset, const LevelView& level) {
  struct Visit {
    std::uint32_t block, depth;
  };
  std::uint32_t blocks = 0, triangles = 0, deepest = 0;
  std::vector<Visit> pending = {{0, 1}};
  while (!pending.empty()) {
    const Visit visit = pending.back();
    pending.pop_back();
    demand(visit.block == blocks++ && visit.block < level.block_count, "blocks lie depth first");
    deepest = std::max(deepest, visit.depth);
    const Block& block = level.blocks[visit.block];
    for (int i = 0; i < kNodesPerBlock; ++i) {
      if (block.kind[i] == NodeKind::imaginary) {
        demand(block.half_extent[0][i] == kImaginaryHalfExtent, "imaginary boxes are empty");
      } else if (block.kind[i] == NodeKind::leaf) {
        demand(block.index[i] == triangles++ && block.index[i] < level.triangle_count,
               "leaves name the triangles one after the other");
        read_triangle(asset, level.triangles[block.index[i]]);
      }
    }
    for (int i = kNodesPerBlock; i-- > 0;) {  // the first child is taken first
      if (block.kind[i] == NodeKind::internal) pending.push_back({block.index[i], visit.depth + 1});
    }
  }
  demand(blocks == level.block_count && triangles == level.triangle_count, "all is reached");
  demand(deepest == level.depth && deepest <= kMaxDepth, "the depth is right and within its limit");
}

// Reads every byte of a text, for the sanitizer.
void read_text(std::string_view text) {
  [[maybe_unused]] static volatile char sink;
  for (const char c : text) sink = c;
}

void examine(const CheckResult& result) {
  demand(name(result.status)[0] != 'U' || result.status == Status::kUnsupportedVersion ||
             result.status == Status::kUnknownSection,
         "every status has a name");
  if (result.status != Status::kOk) return;
  const AssetView& asset = result.asset;
  for (std::uint32_t i = 0; i < asset.levels.size(); ++i) {
    const LevelView level = asset.level(i);
    walk(asset, level);
    const char* defect = level.oriented_blocks != nullptr ? test::defect_of_oriented_blocks(level) : nullptr;
    if (defect == nullptr && level.topology != nullptr) defect = test::defect_of_topology(level);
    demand(defect == nullptr, defect);
    for (std::uint32_t v = 0; v < level.vertex_count && level.source_vertices != nullptr; ++v)
      demand(level.source_vertices[v] < asset.header->source_vertices, "source vertices are in range");
  }
  for (const Part& part : asset.parts) {
    read_text(asset.name_of(part));
    read_text(asset.path_of(part));
  }
  read_text(asset.provenance);
}

// Tells whether a quick check leaves this defect out.
bool is_believed(Status status) {
  return status == Status::kTriangleOutsideOrientedBox || status == Status::kVertexOrder ||
         status == Status::kVertexMismatch || status == Status::kEdgeMismatch ||
         status == Status::kBadWinding || status == Status::kComponentMismatch ||
         status == Status::kSourceVertexMismatch;
}

// A full check proves no less than a quick one.
void compare(const CheckResult& full, const CheckResult& quick) {
  demand(full.status == quick.status || is_believed(full.status),
         "a quick check leaves out what boxes hold and what topology means, and nothing else");
}

// Gives a 32-bit word the number of another one or one near it, or changes its lowest flags: the changes that
// make vertices, edges and components others, and leave them in range.
void change_word(std::uint8_t* data, std::size_t size, std::minstd_rand& random) {
  const auto word = [&] { return random() % (size / 4) * 4; };
  const std::size_t to = word();
  std::uint32_t value = 0;
  std::memcpy(&value, data + (random() % 2 == 0 ? to : word()), sizeof value);
  value = random() % 2 == 0 ? value ^ 1u << random() % 7 : value + 1 - random() % 3;
  std::memcpy(data + to, &value, sizeof value);
}

// Copies a node, child, kind and box, over another one of the same 128 bytes or of any others: the changes
// that make two parents of one block, or leaves beside internal nodes, and keep the rest sound.
void copy_node(std::uint8_t* data, std::size_t size, std::minstd_rand& random) {
  constexpr std::size_t kLane = sizeof(float), kRow = kLane * kNodesPerBlock;
  const std::size_t blocks = size / sizeof(Block);
  const std::size_t to = random() % blocks * sizeof(Block) + random() % kNodesPerBlock * kLane;
  const std::size_t from_block = random() % 2 == 0 ? to / sizeof(Block) : random() % blocks;
  const std::size_t from = from_block * sizeof(Block) + random() % kNodesPerBlock * kLane;
  for (std::size_t row = 0; row < sizeof(Block); row += kRow)
    std::memmove(data + to + row, data + from + row, kLane);
}

}  // namespace

extern "C" std::size_t LLVMFuzzerMutate(std::uint8_t* data, std::size_t size, std::size_t max_size);

extern "C" std::size_t LLVMFuzzerCustomMutator(std::uint8_t* data, std::size_t size, std::size_t max_size,
                                               unsigned seed) {
  std::minstd_rand random(seed);
  const unsigned how = random() % 6;
  if (how > 1 || size < sizeof(Block)) return LLVMFuzzerMutate(data, size, max_size);
  if (how == 0) copy_node(data, size, random);
  if (how == 1) change_word(data, size, random);
  return size;
}

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  Bytes bytes(data, size);
  examine(bytes.check());
  if (size < sizeof(FileHeader)) return 0;
  bytes.disguise();
  const CheckResult full = bytes.check();
  examine(full);
  compare(full, bytes.check(CheckDepth::quick));
  return 0;
}
