#pragma once
#include <cstddef>
#include <cstdint>

#include "tandem/formats/check.h"

namespace tandem {

/// Says how a file gets into memory.
enum class Access : std::uint8_t {
  map,   ///< mmap, read-only: pages are shared with every process that maps the file; falls back to read
  read,  ///< one read into memory of its own: for file systems and platforms that cannot map
};

/// Owns the bytes of a .bvh file in CPU memory and hands out views of them. Movable, not copyable. Throws
/// nothing.
///
/// open() looks at every byte, of all levels of detail, and believes nothing of a file unseen but the error
/// bounds that check() names. Mapping copies nothing: pages are the system's, which takes them back when
/// memory is scarce. If a file has several levels, open() gives them back itself (on Linux), so that the
/// asset takes memory of the process only for the pages of the levels that are used.
///
/// While an asset is mapped, nobody may write into its file or cut it short: what was checked would no longer
/// hold, and reading a page that is gone ends a process. Tools that replace a file by a rename, as bvhbuild
/// does, are safe. For a file already in memory there is nothing to own: call check() of
/// tandem/formats/check.h.
class MappedAsset {
 public:
  MappedAsset() = default;
  MappedAsset(MappedAsset&& other) noexcept { *this = static_cast<MappedAsset&&>(other); }
  MappedAsset& operator=(MappedAsset&& other) noexcept;
  ~MappedAsset() { close(); }

  /// Brings the file into memory and checks it; closes what was open before.
  /// Result: kOk, or the first defect; then nothing is open, and where() is the number of the section,
  /// block or other item that has the defect. `path` is handed to the operating system as it is.
  Status open(const char* path, Access access = Access::map, CheckDepth depth = CheckDepth::full);

  /// Releases the bytes; views of them must not be used any more.
  void close();

  /// The checked asset. Condition: the last open() returned kOk.
  const AssetView& view() const { return asset_; }
  std::uint64_t where() const { return where_; }
  const void* data() const { return data_; }
  std::size_t bytes() const { return bytes_; }
  bool is_mapped() const { return mapped_; }

 private:
  Status acquire(const char* path, Access access);

  void* data_ = nullptr;
  std::size_t bytes_ = 0;
  bool mapped_ = false;
  std::uint64_t where_ = 0;
  AssetView asset_;
};

}  // namespace tandem
