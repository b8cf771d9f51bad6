#pragma once
#include <cstddef>
#include <memory>

#include "tandem/formats/view.h"

namespace tandem::build {

/// The bytes of a whole .bvh file in memory, aligned as the checker wants them. The memory is from allocate()
/// of tandem/formats/allocator.h.
class Image {
 public:
  explicit Image(std::size_t bytes);  ///< all zero
  std::byte* data() { return data_.get(); }
  const std::byte* data() const { return data_.get(); }
  std::size_t size() const { return size_; }
  /// The caller deallocates them.
  std::byte* release() { return data_.release(); }

 private:
  struct Delete {
    void operator()(std::byte* data) const;
  };
  std::unique_ptr<std::byte[], Delete> data_;
  std::size_t size_;
};

/// The bytes of a file, and the view of them.
struct CheckedImage {
  Image image;
  AssetView asset;
};

}  // namespace tandem::build
