#pragma once
#include <nanobind/nanobind.h>

#include <cstddef>
#include <vector>

/// Raw rows that the package's Python files and its extensions hand each other.
namespace tandem::python {

/// The contiguous bytes of a Python object, for as long as this lives.
class Bytes {
 public:
  explicit Bytes(nanobind::handle object) {
    if (PyObject_GetBuffer(object.ptr(), &view_, PyBUF_SIMPLE) != 0) throw nanobind::python_error();
  }
  ~Bytes() { PyBuffer_Release(&view_); }
  Bytes(const Bytes&) = delete;
  Bytes& operator=(const Bytes&) = delete;
  const void* data() const { return view_.buf; }
  std::size_t size() const { return static_cast<std::size_t>(view_.len); }

 private:
  Py_buffer view_;
};

/// Throws ValueError: a buffer is not of whole rows. The package's Python files never let that happen.
[[noreturn]] inline void throw_broken_rows() {
  throw nanobind::value_error("a buffer does not hold whole rows");
}

/// Copies an array's rows, which other threads cannot change in the copy while the interpreter runs them. Its
/// data() is not null, which stands for no array, also where there are no rows.
template <typename Row>
void copy_rows(nanobind::handle object, std::vector<Row>& copy) {
  const Bytes bytes(object);
  if (bytes.size() % sizeof(Row) != 0) throw_broken_rows();
  const Row* first = static_cast<const Row*>(bytes.data());
  const std::size_t count = bytes.size() / sizeof(Row);
  copy.reserve(count + 1);
  copy.assign(first, first + count);
}

/// Does the same in new memory.
template <typename Row>
std::vector<Row> copy_rows(nanobind::handle object) {
  std::vector<Row> copy;
  copy_rows(object, copy);
  return copy;
}

/// A new bytearray with a copy of bytes; null: not yet filled.
inline nanobind::object make_bytes(const void* bytes, std::size_t size) {
  PyObject* made =
      PyByteArray_FromStringAndSize(static_cast<const char*>(bytes), static_cast<Py_ssize_t>(size));
  if (made == nullptr) throw nanobind::python_error();
  return nanobind::steal(made);
}

/// A copy of rows, as a bytearray: NumPy makes an array of it that owns it.
template <typename Row>
nanobind::object to_python(const Row* rows, std::size_t count) {
  return make_bytes(rows, count * sizeof(Row));
}

}  // namespace tandem::python
