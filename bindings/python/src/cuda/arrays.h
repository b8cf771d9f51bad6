#pragma once
#include <cuda_runtime_api.h>

#include <memory>
#include <string>
#include <vector>

#include "../core.h"
#include "dlpack.h"
#include "tandem/tandem_cuda.h"

namespace tandem::python {

inline constexpr dlpack::DataType kU8 = {dlpack::kUInt, 8, 1}, kU32 = {dlpack::kUInt, 32, 1},
                                  kI32 = {dlpack::kInt, 32, 1}, kU64 = {dlpack::kUInt, 64, 1},
                                  kF32 = {dlpack::kFloat, 32, 1}, kF64 = {dlpack::kFloat, 64, 1};

/// Throws the exception of an error of CUDA's.
void check_cuda(cudaError_t error);

/// Checks a status that comes without the number of what is to blame, as check() does.
void check_whole(tandem_status status);

/// Throws ValueError where there are GPUs, but none of this number. Where there is none at all, the call that
/// follows says so. Returns the number.
int require_gpu(int number);

/// While it lives, the device is the current one.
class OnDevice {
 public:
  explicit OnDevice(int device);
  ~OnDevice();
  OnDevice(const OnDevice&) = delete;
  OnDevice& operator=(const OnDevice&) = delete;

 private:
  int before_ = -1;  // -1: it was current
};

inline cudaStream_t stream_of(std::uintptr_t number) {
  return reinterpret_cast<cudaStream_t>(number);
}

/// A stream, and the Python object, or None, that it lives as long as.
class Stream {
 public:
  Stream() = default;
  Stream(std::uintptr_t number, nb::object kept) : stream_(stream_of(number)), kept_(std::move(kept)) {}
  operator cudaStream_t() const { return stream_; }

 private:
  cudaStream_t stream_ = nullptr;
  nb::object kept_;
};

/// GPU memory: where it lies, what keeps it, and whether its contents may still be on their way on a stream.
struct Memory {
  std::shared_ptr<const void> owner;
  int device = 0;
  Stream stream;
  bool ready = true;  ///< the stream has passed what writes there
};

/// An array in GPU memory that is handed out, by DLPack and by the CUDA array interface.
class Array {
 public:
  Array(Memory memory, const void* data, dlpack::DataType type, std::vector<std::int64_t> shape,
        std::vector<std::int64_t> strides)
      : memory_(std::move(memory)),
        data_(data),
        type_(type),
        shape_(std::move(shape)),
        strides_(std::move(strides)) {}

  nb::object dlpack(nb::handle stream) const;
  nb::tuple device() const { return nb::make_tuple(int{dlpack::kCuda}, memory_.device); }
  nb::dict interface() const;
  nb::tuple shape() const;
  std::string dtype() const;
  std::uintptr_t pointer() const { return reinterpret_cast<std::uintptr_t>(data_); }
  std::size_t length() const { return static_cast<std::size_t>(shape_.at(0)); }

 private:
  void wait_on(cudaStream_t consumer) const;

  Memory memory_;
  const void* data_;
  dlpack::DataType type_;
  std::vector<std::int64_t> shape_, strides_;  // in elements
};

/// Rows of a query in GPU memory.
class Rows {
 public:
  Rows(Memory memory, const void* data, std::size_t count, std::size_t row_bytes)
      : memory_(std::move(memory)),
        data_(static_cast<const char*>(data)),
        count_(count),
        row_bytes_(row_bytes) {}

  std::size_t count() const { return count_; }
  /// Returns whole rows as whole numbers of so many bits.
  Array words(unsigned bits) const;
  /// Returns one field of each row: `width` numbers, or one where it is 0.
  Array column(std::size_t offset, std::uint8_t code, std::uint8_t bits, std::int64_t width) const;
  /// A copy in CPU memory, behind what the stream holds.
  nb::object to_cpu() const;

 private:
  Memory memory_;
  const char* data_;
  std::size_t count_, row_bytes_;
};

/// Somebody else's array, which lives as long as this.
class GivenArray {
 public:
  GivenArray() = default;
  /// Takes an array in memory of `device` whose contents are there for what is queued on `stream` from now
  /// on. name: of the argument, for exceptions.
  GivenArray(nb::handle object, const char* name, cudaStream_t stream, int device);
  GivenArray(GivenArray&& other) noexcept { *this = std::move(other); }
  GivenArray& operator=(GivenArray&& other) noexcept;
  ~GivenArray();

  const void* data() const { return data_; }
  const std::vector<std::int64_t>& shape() const { return shape_; }
  const dlpack::DataType& type() const { return type_; }
  /// Throws TypeError where the elements are none of these.
  void require_type(std::initializer_list<dlpack::DataType> types, const char* wanted) const;
  [[noreturn]] void wrong_shape(const char* wanted) const;

 private:
  void take_tensor(nb::handle object, cudaStream_t stream, int device);
  void take_capsule(nb::handle object, cudaStream_t stream, int device);
  void take_interface(const nb::dict& interface, cudaStream_t stream, int device);
  void require_contiguous(const std::int64_t* strides, std::int64_t unit) const;

  std::string name_;
  const void* data_ = nullptr;
  dlpack::DataType type_ = {};
  std::vector<std::int64_t> shape_;
  dlpack::ManagedTensor* managed_ = nullptr;
  PyObject* kept_ = nullptr;
};

/// Throws ValueError where what the argument `name` has lies on GPU `id` instead of `device`.
void require_device(const std::string& name, int id, int device);
std::string name_of(dlpack::DataType type);
std::string text_of(const std::vector<std::int64_t>& shape);

void add_arrays(nb::module_& module);
void add_scenes(nb::module_& module);
void add_gpu_queries(nb::module_& module);
void add_gpu_worlds(nb::module_& module);

}  // namespace tandem::python
