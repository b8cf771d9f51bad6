#pragma once
/// The parts of the extension share this header. The extension takes and gives raw rows; the package's Python
/// files check what the caller gave, and name the arguments.
#include <nanobind/nanobind.h>

#include <atomic>
#include <cstdint>
#include <span>
#include <vector>

#include "bytes.h"
#include "tandem/tandem.h"
#include "without_lock.h"

namespace tandem::python {

namespace nb = nanobind;

/// Throws the Python exception of a status that is not TANDEM_OK (tandem._errors.from_status).
void check(tandem_status status, std::uint64_t where = 0);

/// Throws the exception of a status, with what is wrong in a sentence, and what `where` counts; null: nothing
/// is to blame.
[[noreturn]] void throw_status(tandem_status status, const char* sentence, const char* subject,
                               std::uint64_t where);

/// Throws the exception of a status that blames a vertex among the positions of an asset.
[[noreturn]] void throw_vertex(tandem_status status, std::uint32_t asset, std::uint64_t vertex);

/// An options struct of the C interface with its size, and zeros.
template <typename Options>
Options sized() {
  Options options = {};
  options.struct_size = sizeof options;
  return options;
}

void* bytes_begin(nb::handle bytearray);

/// A turn at what takes one call at a time: a second thread gets RuntimeError, which says `refused`.
class Turn {
 public:
  Turn(std::atomic<bool>& busy, const char* refused);
  ~Turn() { busy_ = false; }
  Turn(const Turn&) = delete;
  Turn& operator=(const Turn&) = delete;

 private:
  std::atomic<bool>& busy_;
};

/// A checked file in memory, by one reference to it.
class Asset {
 public:
  explicit Asset(tandem_asset* asset) : asset_(asset) {}
  ~Asset() { tandem_asset_release(asset_); }
  Asset(Asset&& other) noexcept : asset_(other.asset_) { other.asset_ = nullptr; }
  Asset& operator=(Asset&&) = delete;
  tandem_asset* get() const { return asset_; }

 private:
  tandem_asset* asset_;
};

/// Says which pairs a scene looks at. It has copies of what it was made of, and never changes.
class Filter {
 public:
  Filter(nb::object motion, nb::object group, nb::object mask, nb::object world, nb::object excluded);
  ~Filter() { tandem_excluded_pairs_destroy(excluded_); }
  Filter(const Filter&) = delete;
  Filter& operator=(const Filter&) = delete;
  /// Returns the filter of C, null for none.
  static const tandem_pair_filter* of(const Filter* filter) {
    return filter != nullptr ? &filter->filter_ : nullptr;
  }

 private:
  std::vector<std::uint8_t> motion_;
  std::vector<std::uint32_t> group_, mask_, world_;
  tandem_excluded_pairs* excluded_ = nullptr;
  tandem_pair_filter filter_ = {};
};

/// Returns the counters in the order of tandem.Counters.
nb::tuple counters_of(const tandem_contact_counters& counters);

/// Returns what bvhinfo measures: the version of the file, its tree, of each level its bytes and the work to
/// expect, and the surface of the first, or None.
nb::tuple statistics(const Asset& asset);

void add_assets(nb::module_& module);
void add_builder(nb::module_& module);
void add_filters(nb::module_& module);
void add_mujoco(nb::module_& module);
void add_readers(nb::module_& module);
void add_scenes(nb::module_& module);
void add_touches(nb::module_& module);
void add_worlds(nb::module_& module);

}  // namespace tandem::python
