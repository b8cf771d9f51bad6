#pragma once
#include <cstdint>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "common/report.h"
#include "scene_file.h"

/// The part of HDF5 that scenes and contacts need, with errors that name the file and what is wrong in it.
/// hdf5.h is known to hdf5_file.cpp alone.
namespace tandem::bench {

/// A file that could not be written.
struct OutputError : FileError {
  using FileError::FileError;
};

/// Throws OutputError where a file that is written later could not appear at this path, as far as can be
/// told.
void try_output(const std::string& path);

/// Lengths of a dataset's dimensions, outermost first.
using Shape = std::vector<std::uint64_t>;

/// Reads datasets of an HDF5 file. The file is not trusted: shapes and types are checked first, nothing
/// larger than the file could hold is allocated, and other files that it refers to are not opened. Every
/// function throws FileError.
class Hdf5Input {
 public:
  explicit Hdf5Input(const std::string& path);
  ~Hdf5Input();
  Hdf5Input(const Hdf5Input&) = delete;
  Hdf5Input& operator=(const Hdf5Input&) = delete;

  /// Returns whether there is anything of this name. `name`: from the root, "/instances/asset".
  bool has(const std::string& name) const;

  /// A dataset of integers of any type whose values fit, n rows of shape `row`, in row-major order.
  std::vector<std::uint32_t> read_u32(const std::string& name, const Shape& row = {}) const;

  std::vector<std::uint64_t> read_u64(const std::string& name, const Shape& row = {}) const;

  /// Reads a dataset of numbers that float64 holds without loss.
  std::vector<double> read_f64(const std::string& name, const Shape& row = {}) const;

  /// The number of rows of a dataset that read_f64() would read.
  std::uint64_t count_rows(const std::string& name, const Shape& row) const;

  /// Reads one row of such a dataset. Condition: index < count_rows().
  std::vector<double> read_f64_row(const std::string& name, const Shape& row, std::uint64_t index) const;

  /// The names of what a group holds, sorted; none where there is no such group.
  std::vector<std::string> names_in(const std::string& group) const;

  /// A dataset of n strings, of fixed or variable length.
  std::vector<std::string> read_strings(const std::string& name) const;

  /// An attribute of the root group that is one string, as Hdf5Output writes it.
  std::string read_attribute(const std::string& name) const;

 private:
  struct Dataset;
  Dataset open_integers(const std::string& name, const Shape& row) const;
  Dataset open_numbers(const std::string& name, const Shape& row) const;
  Dataset open(const std::string& name, const Shape& row) const;
  void check_extent(const Dataset& dataset) const;
  void read(const Dataset& dataset, std::int64_t memory_type, void* values) const;
  std::vector<std::string> read_fixed(const Dataset& dataset) const;
  std::vector<std::string> read_variable(const Dataset& dataset) const;
  [[noreturn]] void refuse(const std::string& name, const std::string& reason) const;

  std::string path_;
  std::uint64_t bytes_ = 0;
  std::int64_t file_ = -1;
};

/// An HDF5 file in the making, in memory. The same calls give the same bytes: no times are kept. Throws
/// OutputError.
class Hdf5Output {
 public:
  explicit Hdf5Output(const std::string& path);
  ~Hdf5Output();
  Hdf5Output(const Hdf5Output&) = delete;
  Hdf5Output& operator=(const Hdf5Output&) = delete;

  /// Adds a dataset, and the groups in its name. Condition: as many values as the shape says.
  void add(const std::string& name, const Shape& shape, std::span<const std::uint8_t> values);
  void add(const std::string& name, const Shape& shape, std::span<const std::uint32_t> values);
  void add(const std::string& name, const Shape& shape, std::span<const std::uint64_t> values);
  void add(const std::string& name, const Shape& shape, std::span<const double> values);
  void add(const std::string& name, const std::vector<std::string>& strings);  ///< fixed length, UTF-8

  /// Adds an attribute of the root group.
  void attribute(const std::string& name, std::uint64_t value);
  void attribute(const std::string& name, double value);
  void attribute(const std::string& name, const std::string& value);

  /// Adds the entries of a report that a file has: numbers and texts, booleans as 0 and 1, and of times,
  /// unless they are null, best and median.
  void attributes(const Report& report);

  /// Makes the file at the path hold all of it, or leaves it as it was.
  void write();

 private:
  void add(const std::string& name, const Shape& shape, std::int64_t type, const void* values);
  void attribute(const std::string& name, std::int64_t type, const void* value);
  std::vector<std::byte> image();
  [[noreturn]] void refuse(const std::string& reason) const;

  std::string path_;
  std::int64_t file_ = -1;
};

}  // namespace tandem::bench
