#include "import/gltf_accessor.h"

#include <algorithm>
#include <bit>
#include <limits>
#include <type_traits>
#include <utility>

#include "import/binary_number.h"

namespace tandem::build {
namespace {

// Offsets and counts come from JSON, where they may be as large as they like. Below this bound, products with
// a stride or an element's size (both less than 2^10) and their sums stay far below 2^64.
constexpr std::uint64_t kMostBytes = std::uint64_t{1} << 50;

std::string place(const char* list, std::int64_t index) {
  return std::string(list) + "[" + std::to_string(index) + "]";
}

std::string is_missing(const std::string& user, const char* list, int index, std::size_t held) {
  return user + " names " + place(list, index) + " of " + std::to_string(held);
}

std::string ends_outside(const std::string& what, std::uint64_t end, const std::string& whole,
                         std::uint64_t bytes) {
  return what + " ends at byte " + std::to_string(end) + " of " + whole + ", which has " +
         std::to_string(bytes);
}

template <class Item>
bool holds(const std::vector<Item>& items, int index) {
  return index >= 0 && static_cast<std::size_t>(index) < items.size();
}

/// Calls `use` with a zero of the C++ type that a component type stands for; false for types of no meaning.
template <class Use>
bool with_component(int type, const Use& use) {
  switch (type) {
    case kInt8:
      return use(std::int8_t{}), true;
    case kUint8:
      return use(std::uint8_t{}), true;
    case kInt16:
      return use(std::int16_t{}), true;
    case kUint16:
      return use(std::uint16_t{}), true;
    case kUint32:
      return use(std::uint32_t{}), true;
    case kFloat32:
      return use(float{}), true;
    case kFloat64:
      return use(double{}), true;
    default:
      return false;
  }
}

std::uint64_t component_bytes(int type) {
  std::uint64_t bytes = 0;
  with_component(type, [&](auto zero) { bytes = sizeof zero; });
  return bytes;
}

std::uint64_t element_bytes(const GltfAccessor& accessor) {
  return component_bytes(accessor.component_type) * static_cast<std::uint64_t>(accessor.components);
}

/// A run of elements in a buffer.
struct Run {
  const char* data = nullptr;
  std::uint64_t stride = 0;
};

/// What a run of elements needs of a buffer view.
struct Need {
  std::string user;  ///< for messages
  int view;
  std::uint64_t offset, count, bytes;  ///< of one element
};

std::string check_view(const GltfModel& model, const std::string& user, int index) {
  if (!holds(model.views, index)) return is_missing(user, "bufferViews", index, model.views.size());
  const GltfView& view = model.views[index];
  const std::string name = place("bufferViews", index);
  if (!holds(model.buffers, view.buffer))
    return is_missing(name, "buffers", view.buffer, model.buffers.size());
  const std::uint64_t held = model.buffers[view.buffer].size();
  if (view.offset > kMostBytes || view.bytes > kMostBytes) return name + " lies beyond every buffer";
  if (view.offset + view.bytes > held)
    return ends_outside(name, view.offset + view.bytes, place("buffers", view.buffer), held);
  return {};
}

/// Finds the elements; empty, or why they are not all there.
std::string locate(const GltfModel& model, const Need& need, Run& run) {
  std::string wrong = check_view(model, need.user, need.view);
  if (!wrong.empty()) return wrong;
  const GltfView& view = model.views[need.view];
  const std::string name = place("bufferViews", need.view);
  run.stride = view.stride == 0 ? need.bytes : view.stride;
  if (run.stride < need.bytes || run.stride > 255)
    return name + " has a stride of " + std::to_string(view.stride) + " bytes, an element of " + need.user +
           " has " + std::to_string(need.bytes);
  if (need.offset > kMostBytes || need.count > kMostBytes) return need.user + " lies beyond every buffer";
  const std::uint64_t end = need.offset + (need.count == 0 ? 0 : (need.count - 1) * run.stride + need.bytes);
  if (end > view.bytes) return ends_outside(need.user, end, name, view.bytes);
  run.data = reinterpret_cast<const char*>(model.buffers[view.buffer].data()) + view.offset + need.offset;
  return {};
}

/// Where an accessor's elements lie. `indices` and `values` belong to its sparse part.
struct Layout {
  Run base, indices, values;
};

bool is_index_type(int type) {
  return type == kUint8 || type == kUint16 || type == kUint32;
}

std::string lay_out_sparse(const GltfModel& model, int index, Layout& layout) {
  const GltfAccessor& accessor = model.accessors[index];
  const GltfSparse& sparse = *accessor.sparse;
  const std::string name = place("accessors", index) + ".sparse";
  if (!is_index_type(sparse.index_type))
    return name + ".indices are of type " + std::to_string(sparse.index_type) +
           ", which is no unsigned integer";
  const Need indices{name + ".indices", sparse.index_view, sparse.index_offset, sparse.count,
                     component_bytes(sparse.index_type)};
  const Need values{name + ".values", sparse.value_view, sparse.value_offset, sparse.count,
                    element_bytes(accessor)};
  std::string wrong = locate(model, indices, layout.indices);
  if (wrong.empty()) wrong = locate(model, values, layout.values);
  return wrong;
}

/// Of an accessor that is there and of a type with a meaning.
std::string lay_out(const GltfModel& model, int index, Layout& layout) {
  const GltfAccessor& accessor = model.accessors[index];
  std::string wrong;
  if (accessor.view != -1) {
    const Need need{place("accessors", index), accessor.view, accessor.offset, accessor.count,
                    element_bytes(accessor)};
    wrong = locate(model, need, layout.base);
  }
  if (wrong.empty() && accessor.sparse) wrong = lay_out_sparse(model, index, layout);
  return wrong;
}

std::string check(const GltfModel& model, int index, int components, bool (*is_fit)(int),
                  const char* purpose) {
  if (!holds(model.accessors, index)) return is_missing(purpose, "accessors", index, model.accessors.size());
  const GltfAccessor& accessor = model.accessors[index];
  if (accessor.components != components)
    return place("accessors", index) + " has " + std::to_string(accessor.components) +
           " numbers in an element, where " + purpose + " needs " + std::to_string(components);
  if (!is_fit(accessor.component_type))
    return place("accessors", index) + " has numbers of type " + std::to_string(accessor.component_type) +
           ", which " + purpose + " cannot have";
  Layout layout;
  return lay_out(model, index, layout);
}

/// Sets the elements of the sparse part: `store(i, bytes)`.
template <class Store>
std::string read_sparse(const GltfAccessor& accessor, int index, const Layout& layout, const Store& store) {
  const GltfSparse& sparse = *accessor.sparse;
  std::string wrong;
  with_component(sparse.index_type, [&](auto zero) {
    if constexpr (std::is_unsigned_v<decltype(zero)>)
      for (std::uint64_t i = 0; i < sparse.count && wrong.empty(); ++i) {
        const auto element =
            load_number<decltype(zero), std::endian::little>(layout.indices.data + i * layout.indices.stride);
        if (element < accessor.count)
          store(element, layout.values.data + i * layout.values.stride);
        else
          wrong = place("accessors", index) + ".sparse replaces element " + std::to_string(element) + " of " +
                  std::to_string(accessor.count);
      }
  });
  return wrong;
}

/// Fills `items` with the elements of an accessor, each made of its bytes by `convert`.
template <class Item, class Convert>
std::string read_elements(const GltfModel& model, int index, std::vector<Item>& items,
                          const Convert& convert) {
  const GltfAccessor& accessor = model.accessors[index];
  Layout layout;
  std::string wrong = lay_out(model, index, layout);
  if (!wrong.empty()) return wrong;
  items.assign(accessor.count, Item{});
  if (accessor.view != -1)
    for (std::uint64_t i = 0; i < accessor.count; ++i)
      items[i] = convert(layout.base.data + i * layout.base.stride);
  if (!accessor.sparse) return {};
  return read_sparse(accessor, index, layout,
                     [&](std::size_t i, const char* bytes) { items[i] = convert(bytes); });
}

/// A component of a position. Normalised integers stand for fractions (glTF 2.0, section 3.6.2.2).
template <class T>
double coordinate(const char* bytes, bool normalized) {
  const double value = load_number<T, std::endian::little>(bytes);
  if constexpr (std::is_integral_v<T>)
    if (normalized) return std::max(value / std::numeric_limits<T>::max(), -1.0);
  return value;
}

bool is_position_type(int type) {
  return type != kUint32 && component_bytes(type) != 0;
}

}  // namespace

std::string check_positions(const GltfModel& model, int accessor) {
  return check(model, accessor, 3, is_position_type, "POSITION");
}

std::string check_indices(const GltfModel& model, int accessor) {
  return check(model, accessor, 1, is_index_type, "an index");
}

std::string read_positions(const GltfModel& model, int accessor, std::vector<Point>& points) {
  const bool normalized = model.accessors[accessor].normalized;
  std::string wrong;
  with_component(model.accessors[accessor].component_type, [&](auto zero) {
    using T = decltype(zero);
    wrong = read_elements(model, accessor, points, [normalized](const char* bytes) {
      return Point{coordinate<T>(bytes, normalized), coordinate<T>(bytes + sizeof(T), normalized),
                   coordinate<T>(bytes + 2 * sizeof(T), normalized)};
    });
  });
  return wrong;
}

std::string read_indices(const GltfModel& model, int accessor, std::vector<std::uint32_t>& indices) {
  std::string wrong;
  with_component(model.accessors[accessor].component_type, [&](auto zero) {
    using T = decltype(zero);
    if constexpr (std::is_unsigned_v<T>)
      wrong = read_elements(model, accessor, indices, [](const char* bytes) {
        const T index = load_number<T, std::endian::little>(bytes);
        return index == std::numeric_limits<T>::max() ? kNoVertex : std::uint32_t{index};
      });
  });
  return wrong;
}

}  // namespace tandem::build
