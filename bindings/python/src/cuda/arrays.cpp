#include "arrays.h"

#include <nanobind/stl/string.h>

#include <algorithm>
#include <cstdlib>
#include <cstring>
#include <string_view>
#include <utility>

namespace tandem::python {
namespace {

constexpr const char* kCapsule = "dltensor";
constexpr const char* kUsedCapsule = "used_dltensor";
constexpr const char* kNotContiguous = " is not contiguous, and nothing is copied";
const cudaStream_t kLegacy = cudaStreamLegacy;

// The tensor that a capsule keeps until its consumer, or nobody, has taken it.
struct Exported {
  dlpack::ManagedTensor managed;
  std::shared_ptr<const void> owner;
  std::vector<std::int64_t> shape, strides;
};

void delete_exported(dlpack::ManagedTensor* managed) {
  delete static_cast<Exported*>(managed->context);
}

void delete_capsule(PyObject* capsule) {
  if (PyCapsule_IsValid(capsule, kCapsule) == 0) return;  // taken
  auto* managed = static_cast<dlpack::ManagedTensor*>(PyCapsule_GetPointer(capsule, kCapsule));
  managed->deleter(managed);
}

// Makes `later` wait for what `earlier` holds now.
void order(cudaStream_t earlier, cudaStream_t later) {
  cudaEvent_t event = nullptr;
  check_cuda(cudaEventCreateWithFlags(&event, cudaEventDisableTiming));
  cudaError_t error = cudaEventRecord(event, earlier);
  if (error == cudaSuccess) error = cudaStreamWaitEvent(later, event, 0);
  static_cast<void>(cudaEventDestroy(event));
  check_cuda(error);
}

// Streams as the protocols number them: 1 is the default stream.
std::uintptr_t number_of(cudaStream_t stream) {
  return stream == nullptr ? 1 : reinterpret_cast<std::uintptr_t>(stream);
}

bool is_default(cudaStream_t stream) {
  return stream == nullptr || stream == kLegacy;
}

// Returns the type of a name such as "float64". Only numbers of 8 bits and more are wanted anywhere.
dlpack::DataType type_named(const std::string& name) {
  const std::size_t digits = name.find_first_of("0123456789");
  const std::string kind = name.substr(0, digits);
  const std::uint8_t code = kind == "int"     ? dlpack::kInt
                            : kind == "uint"  ? dlpack::kUInt
                            : kind == "float" ? dlpack::kFloat
                                              : dlpack::kOther;
  const int bits = digits == std::string::npos ? 0 : std::atoi(name.c_str() + digits);
  return {code, static_cast<std::uint8_t>(bits), 1};
}

// Returns whether it is a tensor of PyTorch.
bool is_torch(nb::handle object) {
  const nb::object module = object.type().attr("__module__");
  return PyUnicode_CompareWithASCIIString(module.ptr(), "torch") == 0;
}

// The number of PyTorch's current stream, as compilers for PyTorch ask for it: an object of the stream takes
// 5 us.
cudaStream_t torch_stream(int device) {
  const nb::object number = nb::module_::import_("torch._C").attr("_cuda_getCurrentRawStream")(device);
  return stream_of(nb::cast<std::uintptr_t>(number));
}

}  // namespace

void check_cuda(cudaError_t error) {
  if (error == cudaSuccess) return;
  static_cast<void>(cudaGetLastError());
  PyErr_SetString(PyExc_RuntimeError, (std::string("CUDA: ") + cudaGetErrorString(error)).c_str());
  throw nb::python_error();
}

void check_whole(tandem_status status) {
  if (status != TANDEM_OK) throw_status(status, tandem_status_explain(status), nullptr, 0);
}

int require_gpu(int number) {
  int count = 0;
  if (cudaGetDeviceCount(&count) != cudaSuccess) static_cast<void>(cudaGetLastError());
  if (count == 0 || (number >= 0 && number < count)) return number;
  throw nb::value_error(
      ("device is GPU " + std::to_string(number) + " where 0 to " + std::to_string(count - 1) + " are there")
          .c_str());
}

OnDevice::OnDevice(int device) {
  int current = -1;
  // If there is no GPU, the call that follows says so.
  if (cudaGetDevice(&current) != cudaSuccess || (current != device && cudaSetDevice(device) != cudaSuccess))
    static_cast<void>(cudaGetLastError());
  else if (current != device)
    before_ = current;
}

OnDevice::~OnDevice() {
  if (before_ >= 0) static_cast<void>(cudaSetDevice(before_));
}

void require_device(const std::string& name, int id, int device) {
  if (id == device) return;
  throw nb::value_error((name + " lies in the memory of GPU " + std::to_string(id) + " where that of GPU " +
                         std::to_string(device) + " is wanted")
                            .c_str());
}

std::string name_of(dlpack::DataType type) {
  const char* kind = type.code == dlpack::kInt     ? "int"
                     : type.code == dlpack::kUInt  ? "uint"
                     : type.code == dlpack::kFloat ? "float"
                                                   : "type ";
  return kind + std::to_string(type.bits) + (type.lanes == 1 ? "" : "x" + std::to_string(type.lanes));
}

std::string text_of(const std::vector<std::int64_t>& shape) {
  std::string text = "(";
  for (std::size_t i = 0; i < shape.size(); ++i) text += (i == 0 ? "" : ", ") + std::to_string(shape[i]);
  return text + (shape.size() == 1 ? ",)" : ")");
}

// ---- Arrays that are handed out

void Array::wait_on(cudaStream_t consumer) const {
  const bool same = consumer == memory_.stream || (is_default(consumer) && is_default(memory_.stream));
  if (memory_.ready || same) return;
  const OnDevice current(memory_.device);
  order(memory_.stream, consumer);
}

nb::object Array::dlpack(nb::handle stream) const {
  // None is the default stream; with -1 the consumer takes care.
  const long long number = stream.is_none() ? 1 : nb::cast<long long>(stream);
  if (number != -1) wait_on(stream_of(static_cast<std::uintptr_t>(number)));
  auto exported = std::make_unique<Exported>();
  exported->owner = memory_.owner;
  exported->shape = shape_;
  exported->strides = strides_;
  exported->managed = {{const_cast<void*>(data_),
                        {dlpack::kCuda, memory_.device},
                        static_cast<std::int32_t>(shape_.size()),
                        type_,
                        exported->shape.data(),
                        exported->strides.data(),
                        0},
                       exported.get(),
                       delete_exported};
  PyObject* const capsule = PyCapsule_New(&exported->managed, kCapsule, delete_capsule);
  if (capsule == nullptr) throw nb::python_error();
  static_cast<void>(exported.release());
  return nb::steal(capsule);
}

nb::tuple Array::shape() const {
  nb::list list;
  for (const std::int64_t length : shape_) list.append(length);
  return nb::tuple(list);
}

std::string Array::dtype() const {
  return name_of(type_);
}

nb::dict Array::interface() const {
  nb::list strides;
  for (const std::int64_t stride : strides_) strides.append(stride * type_.bits / 8);
  const char kind = type_.code == dlpack::kFloat ? 'f' : type_.code == dlpack::kInt ? 'i' : 'u';
  nb::dict result;
  result["shape"] = shape();
  result["typestr"] = (type_.bits == 8 ? "|" : "<") + std::string(1, kind) + std::to_string(type_.bits / 8);
  result["data"] = nb::make_tuple(pointer(), false);
  result["strides"] = nb::tuple(strides);
  result["version"] = 3;
  result["stream"] = memory_.ready ? nb::none() : nb::object(nb::int_(number_of(memory_.stream)));
  return result;
}

Array Rows::words(unsigned bits) const {
  const auto width = static_cast<std::int64_t>(row_bytes_ * 8 / bits);
  const dlpack::DataType type = {dlpack::kUInt, static_cast<std::uint8_t>(bits), 1};
  return {memory_, data_, type, {static_cast<std::int64_t>(count_), width}, {width, 1}};
}

Array Rows::column(std::size_t offset, std::uint8_t code, std::uint8_t bits, std::int64_t width) const {
  const auto count = static_cast<std::int64_t>(count_),
             stride = static_cast<std::int64_t>(row_bytes_ * 8 / bits);
  const dlpack::DataType type = {code, bits, 1};
  const char* const first = data_ != nullptr ? data_ + offset : nullptr;
  if (width == 0) return {memory_, first, type, {count}, {stride}};
  return {memory_, first, type, {count, width}, {stride, 1}};
}

nb::object Rows::to_cpu() const {
  nb::object bytes = make_bytes(nullptr, count_ * row_bytes_);
  if (count_ == 0) return bytes;
  void* const to = bytes_begin(bytes);
  const OnDevice current(memory_.device);
  cudaError_t error = cudaMemcpyAsync(to, data_, count_ * row_bytes_, cudaMemcpyDeviceToHost, memory_.stream);
  if (error == cudaSuccess) {
    const WithoutLock other_threads_run;
    error = cudaStreamSynchronize(memory_.stream);
  }
  check_cuda(error);
  return bytes;
}

// ---- Arrays that are given

// The delegation makes the destructor run, and give the array back, where something is wrong with it.
GivenArray::GivenArray(nb::handle object, const char* name, cudaStream_t stream, int device) : GivenArray() {
  name_ = name;
  if (is_torch(object)) {
    take_tensor(object, stream, device);
  } else if (nb::hasattr(object, "__dlpack__") && nb::hasattr(object, "__dlpack_device__")) {
    take_capsule(object, stream, device);
  } else if (nb::hasattr(object, "__cuda_array_interface__")) {
    take_interface(nb::cast<nb::dict>(object.attr("__cuda_array_interface__")), stream, device);
  } else {
    throw nb::type_error(
        (name_ + " is " + nb::type_name(object.type()).c_str() +
         " where an array in GPU memory is wanted: one with DLPack or __cuda_array_interface__")
            .c_str());
  }
  kept_ = object.inc_ref().ptr();
}

GivenArray& GivenArray::operator=(GivenArray&& other) noexcept {
  std::swap(name_, other.name_);
  std::swap(data_, other.data_);
  std::swap(type_, other.type_);
  std::swap(shape_, other.shape_);
  std::swap(managed_, other.managed_);
  std::swap(kept_, other.kept_);
  return *this;
}

GivenArray::~GivenArray() {
  if (managed_ != nullptr && managed_->deleter != nullptr) managed_->deleter(managed_);
  Py_XDECREF(kept_);
}

void GivenArray::require_contiguous(const std::int64_t* strides, std::int64_t unit) const {
  std::int64_t wanted = unit;
  for (std::size_t i = shape_.size(); strides != nullptr && i-- > 0;) {
    if (shape_[i] == 0) return;
    if (shape_[i] != 1 && strides[i] != wanted) throw nb::value_error((name_ + kNotContiguous).c_str());
    wanted *= shape_[i];
  }
}

// PyTorch's protocols take 10 us for an array; this takes one.
void GivenArray::take_tensor(nb::handle object, cudaStream_t stream, int device) {
  if (!nb::cast<bool>(object.attr("is_cuda")))
    throw nb::type_error((name_ + " lies in CPU memory where GPU memory is wanted").c_str());
  require_device(name_, nb::cast<int>(object.attr("get_device")()), device);
  if (nb::cast<bool>(object.attr("requires_grad")))
    throw nb::value_error(
        (name_ + " requires a gradient, of which a query knows nothing: detach() it").c_str());
  for (nb::handle length : object.attr("shape")) shape_.push_back(nb::cast<std::int64_t>(length));
  if (!nb::cast<bool>(object.attr("is_contiguous")()))
    throw nb::value_error((name_ + kNotContiguous).c_str());
  const nb::object type = object.attr("dtype");
  type_ = type_named(nb::cast<std::string>(nb::str(nb::handle(type))).substr(std::strlen("torch.")));
  data_ = reinterpret_cast<const void*>(nb::cast<std::uintptr_t>(object.attr("data_ptr")()));
  const cudaStream_t producer = torch_stream(device);
  if (producer == stream || (is_default(producer) && is_default(stream))) return;
  const OnDevice current(device);
  order(producer, stream);
}

void GivenArray::take_capsule(nb::handle object, cudaStream_t stream, int device) {
  const nb::object where = object.attr("__dlpack_device__")();
  const int kind = nb::cast<int>(nb::int_(where[0]));
  if (kind != dlpack::kCuda && kind != dlpack::kCudaManaged)
    throw nb::type_error(
        (name_ + " lies in CPU memory, or on another kind of device, where GPU memory is wanted").c_str());
  require_device(name_, nb::cast<int>(nb::int_(where[1])), device);
  const OnDevice current(device);  // some hand out arrays of the current device alone
  const nb::object capsule = object.attr("__dlpack__")(nb::arg("stream") = number_of(stream));
  auto* const managed = static_cast<dlpack::ManagedTensor*>(PyCapsule_GetPointer(capsule.ptr(), kCapsule));
  if (managed == nullptr || PyCapsule_SetName(capsule.ptr(), kUsedCapsule) != 0) throw nb::python_error();
  managed_ = managed;
  const dlpack::Tensor& tensor = managed->tensor;
  type_ = tensor.dtype;
  shape_.assign(tensor.shape, tensor.shape + tensor.ndim);
  data_ = static_cast<const char*>(tensor.data) + tensor.byte_offset;
  require_contiguous(tensor.strides, 1);
}

void GivenArray::take_interface(const nb::dict& interface, cudaStream_t stream, int device) {
  const std::string type = nb::cast<std::string>(interface["typestr"]);
  const bool known = type.size() == 3 && type[0] != '>' &&
                     std::string_view("fiu").find(type[1]) != std::string_view::npos &&
                     std::string_view("1248").find(type[2]) != std::string_view::npos;
  if (!known) throw nb::type_error((name_ + " has elements " + type + ", which nothing here takes").c_str());
  const std::uint8_t code = type[1] == 'f' ? dlpack::kFloat : type[1] == 'i' ? dlpack::kInt : dlpack::kUInt;
  type_ = {code, static_cast<std::uint8_t>(8 * (type[2] - '0')), 1};
  for (nb::handle length : nb::cast<nb::tuple>(interface["shape"]))
    shape_.push_back(nb::cast<std::int64_t>(length));
  if (std::ranges::any_of(shape_, [](std::int64_t length) { return length < 0; }))
    wrong_shape("lengths of 0 or more");
  if (interface.contains("mask") && !interface["mask"].is_none())
    throw nb::value_error((name_ + " has a mask, which nothing here takes").c_str());
  data_ = reinterpret_cast<const void*>(nb::cast<std::uintptr_t>(nb::cast<nb::tuple>(interface["data"])[0]));
  if (interface.contains("strides") && !interface["strides"].is_none()) {
    std::vector<std::int64_t> strides;
    for (nb::handle stride : nb::cast<nb::tuple>(interface["strides"]))
      strides.push_back(nb::cast<std::int64_t>(stride));
    if (strides.size() != shape_.size())
      throw nb::value_error((name_ + " has " + std::to_string(strides.size()) +
                             " strides where its shape is " + text_of(shape_))
                                .c_str());
    require_contiguous(strides.data(), type_.bits / 8);
  }
  cudaPointerAttributes attributes = {};
  if (data_ != nullptr) {
    check_cuda(cudaPointerGetAttributes(&attributes, data_));
    require_device(name_, attributes.device, device);
  }
  // A stream that is told has to be waited for.
  if (!interface.contains("stream") || interface["stream"].is_none()) return;
  const cudaStream_t producer = stream_of(nb::cast<std::uintptr_t>(interface["stream"]));
  if (producer != stream && !(is_default(producer) && is_default(stream))) order(producer, stream);
}

void GivenArray::require_type(std::initializer_list<dlpack::DataType> types, const char* wanted) const {
  for (const dlpack::DataType& type : types) {
    if (type == type_) return;
  }
  throw nb::type_error((name_ + " is " + name_of(type_) + " where " + wanted + " is wanted").c_str());
}

void GivenArray::wrong_shape(const char* wanted) const {
  throw nb::value_error(
      (name_ + " has shape " + text_of(shape_) + " where " + wanted + " is wanted").c_str());
}

void add_arrays(nb::module_& module) {
  nb::class_<Stream>(module, "Stream")
      .def(nb::init<std::uintptr_t, nb::object>(), nb::arg(), nb::arg().none());
  nb::class_<Array>(module, "Array")
      .def(
          "__dlpack__",
          [](const Array& self, nb::handle stream, nb::handle, nb::handle device, nb::handle copy) {
            if (!copy.is_none() && nb::cast<bool>(copy)) throw nb::buffer_error("nothing is copied here");
            if (!device.is_none() && !nb::tuple(device).equal(self.device()))
              throw nb::buffer_error("the array stays on its device");
            return self.dlpack(stream);
          },
          nb::kw_only(), nb::arg("stream").none() = nb::none(), nb::arg("max_version").none() = nb::none(),
          nb::arg("dl_device").none() = nb::none(), nb::arg("copy").none() = nb::none())
      .def("__dlpack_device__", &Array::device)
      .def_prop_ro("__cuda_array_interface__", &Array::interface)
      .def_prop_ro("shape", &Array::shape)
      .def_prop_ro("dtype", &Array::dtype)
      .def_prop_ro("pointer", &Array::pointer)
      .def("__len__", &Array::length);
  nb::class_<Rows>(module, "Rows")
      .def("__len__", &Rows::count)
      .def("words", &Rows::words)
      .def("column", &Rows::column)
      .def("to_cpu", &Rows::to_cpu);
}

}  // namespace tandem::python
