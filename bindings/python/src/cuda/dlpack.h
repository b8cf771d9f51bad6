#pragma once
#include <cstdint>

/// The structs of DLPack 0.8 (dmlc/dlpack, dlpack.h), by which arrays go from library to library.
namespace tandem::python::dlpack {

struct Device {
  std::int32_t type;
  std::int32_t id;
};

inline constexpr std::int32_t kCuda = 2, kCudaManaged = 13;

struct DataType {
  std::uint8_t code;
  std::uint8_t bits;
  std::uint16_t lanes;

  friend bool operator==(const DataType&, const DataType&) = default;
};

inline constexpr std::uint8_t kInt = 0, kUInt = 1, kFloat = 2;
inline constexpr std::uint8_t kOther = 255;  ///< no code of DLPack's

struct Tensor {
  void* data;
  Device device;
  std::int32_t ndim;
  DataType dtype;
  std::int64_t* shape;
  std::int64_t* strides;  ///< in elements; null: C order
  std::uint64_t byte_offset;
};

struct ManagedTensor {
  Tensor tensor;
  void* context;
  void (*deleter)(ManagedTensor* self);
};

}  // namespace tandem::python::dlpack
