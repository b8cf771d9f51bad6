#pragma once
#include <gtest/gtest.h>

#include <functional>
#include <span>

#include "sample_asset.h"

namespace tandem::test {

/// Says what a hostile writer does to a file, and which defect must be named. The file's hash is right.
struct Attack {
  const char* what;
  Status expected;
  std::function<void(Bytes&)> apply;
};

/// 30 triangles: 8 leaf blocks, 3 internal blocks, 3 levels of blocks at most, 2 + 2 imaginary nodes.
inline Bytes sample() {
  return Bytes(make_file(random_mesh(30, 1)));
}

/// A full check names every defect, and a quick one those that it does not believe.
inline void expect_all_named(const Bytes& sound, std::span<const Attack> attacks,
                             bool (*believed)(Status) = nullptr) {
  for (const Attack& attack : attacks) {
    SCOPED_TRACE(attack.what);
    Bytes file = sound;
    attack.apply(file);
    const Status status = file.check_sealed();
    EXPECT_EQ(status, attack.expected) << name(status);
    if (believed == nullptr) continue;
    EXPECT_EQ(file.check(CheckDepth::quick).status,
              believed(attack.expected) ? Status::kOk : attack.expected);
  }
}

/// Each byte of a range changed in each way by a writer that computes the hash too: calls look(result)
/// where the file passes.
template <typename Look>
void for_each_sealed_change(Bytes& file, std::size_t begin, std::size_t end,
                            std::initializer_list<unsigned> changes, const Look& look) {
  for (std::size_t i = begin; i < end; ++i) {
    for (const unsigned change : changes) {
      SCOPED_TRACE(testing::Message() << i << " ^ " << change);
      file.data()[i] ^= static_cast<unsigned char>(change);
      seal(file.data(), file.size());
      const CheckResult result = file.check();
      if (result.status == Status::kOk) look(result);
      file.data()[i] ^= static_cast<unsigned char>(change);
    }
  }
}

/// A section with its bytes.
struct Piece {
  Section row;
  std::string bytes;
};

inline std::vector<Piece> pieces_of(Bytes& file) {
  std::vector<Piece> pieces;
  for (std::size_t i = 0; i < file.header().section_count; ++i) {
    const Section& row = file.section(i);
    pieces.push_back({row, {reinterpret_cast<char*>(file.data()) + row.offset, row.bytes}});
  }
  return pieces;
}

/// A file of these sections, each with as many elements as its row says and bytes as it has.
inline Bytes lay_out(const FileHeader& header, std::vector<Piece> pieces) {
  const auto aligned = [](std::size_t at) {
    return (at + kSectionAlignment - 1) / kSectionAlignment * kSectionAlignment;
  };
  std::string bytes(aligned(sizeof header + pieces.size() * sizeof(Section)), '\0');
  for (Piece& piece : pieces) {
    piece.row.offset = bytes.size();
    piece.row.bytes = piece.bytes.size();
    bytes += piece.bytes;
    bytes.resize(aligned(bytes.size()), '\0');
  }
  Bytes file(bytes.data(), bytes.size());
  file.header() = header;
  file.header().file_bytes = file.size();
  file.header().section_count = static_cast<std::uint32_t>(pieces.size());
  for (std::size_t i = 0; i < pieces.size(); ++i) file.section(i) = pieces[i].row;
  seal(file.data(), file.size());
  return file;
}

}  // namespace tandem::test
