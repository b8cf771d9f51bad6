#include "gltf_accessor.h"

#include <algorithm>
#include <array>
#include <bit>
#include <limits>
#include <string_view>
#include <type_traits>
#include <utility>

#include "scanner.h"

namespace tandem::build {
namespace {

void check_end(const std::string& what, std::uint64_t end, const std::string& whole, std::uint64_t bytes) {
  if (end > bytes)
    throw GltfError(what + " ends at byte " + std::to_string(end) + " of " + whole + ", which has " +
                    std::to_string(bytes));
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

/// A run of elements that a buffer view must hold.
struct Need {
  std::string user;  ///< for messages
  int view;
  std::uint64_t offset, count, bytes;  ///< of one element
};

/// The bytes of a view.
std::string_view bytes_of(const GltfModel& model, const GltfView& view, const std::string& name) {
  const GltfBuffer& buffer = named(model.buffers, "buffers", view.buffer, name);
  check_end(name, view.offset + view.bytes, numbered("buffers", view.buffer), buffer.bytes.size());
  return buffer.bytes.substr(view.offset, view.bytes);
}

/// No sum overflows: offsets and counts, from GltfObject::size(), are below 2^53, and strides below 2^8.
Run locate(const GltfModel& model, const Need& need) {
  const GltfView& view = named(model.views, "bufferViews", need.view, need.user);
  const std::string name = numbered("bufferViews", need.view);
  const std::string_view bytes = bytes_of(model, view, name);
  const std::uint64_t stride = view.stride == 0 ? need.bytes : view.stride;
  if (stride < need.bytes || stride > 255)
    throw GltfError(name + " has a stride of " + std::to_string(view.stride) + " bytes, an element of " +
                    need.user + " has " + std::to_string(need.bytes));
  const std::uint64_t end = need.offset + (need.count == 0 ? 0 : (need.count - 1) * stride + need.bytes);
  check_end(need.user, end, name, bytes.size());
  return {bytes.data() + need.offset, stride};
}

/// Says where an accessor's elements lie. `indices` and `values` belong to its sparse part.
struct Layout {
  Run base, indices, values;
};

bool is_index_type(int type) {
  return type == kUint8 || type == kUint16 || type == kUint32;
}

/// Lays out an accessor that is there and of a type with a meaning.
Layout lay_out(const GltfModel& model, int index) {
  const GltfAccessor& accessor = model.accessors[index];
  const std::string name = numbered("accessors", index);
  Layout layout;
  if (accessor.view != -1)
    layout.base =
        locate(model, {name, accessor.view, accessor.offset, accessor.count, element_bytes(accessor)});
  if (!accessor.sparse) return layout;
  const GltfSparse& sparse = *accessor.sparse;
  if (!is_index_type(sparse.index_type))
    throw GltfError(name + ".sparse.indices are of type " + std::to_string(sparse.index_type) +
                    ", which is no unsigned integer");
  if (sparse.count > accessor.count)
    throw GltfError(name + ".sparse replaces " + std::to_string(sparse.count) + " elements of " +
                    std::to_string(accessor.count));
  layout.indices = locate(model, {name + ".sparse.indices", sparse.index_view, sparse.index_offset,
                                  sparse.count, component_bytes(sparse.index_type)});
  layout.values = locate(model, {name + ".sparse.values", sparse.value_view, sparse.value_offset,
                                 sparse.count, element_bytes(accessor)});
  return layout;
}

void check(const GltfModel& model, int index, int components, bool (*is_fit)(int), const char* purpose) {
  const GltfAccessor& accessor = named(model.accessors, "accessors", index, purpose);
  if (accessor.components != components)
    throw GltfError(numbered("accessors", index) + " has " + std::to_string(accessor.components) +
                    " numbers in an element, where " + purpose + " needs " + std::to_string(components));
  if (!is_fit(accessor.component_type))
    throw GltfError(numbered("accessors", index) + " has numbers of type " +
                    std::to_string(accessor.component_type) + ", which " + purpose + " cannot have");
  lay_out(model, index);
}

/// Sets the elements of the sparse part: `store(i, bytes)`.
template <class Store>
void read_sparse(const GltfAccessor& accessor, int index, const Layout& layout, const Store& store) {
  with_component(accessor.sparse->index_type, [&](auto zero) {
    if constexpr (std::is_unsigned_v<decltype(zero)>)
      for (std::uint64_t i = 0; i < accessor.sparse->count; ++i) {
        const auto element =
            load_number<decltype(zero), std::endian::little>(layout.indices.data + i * layout.indices.stride);
        if (element >= accessor.count)
          throw GltfError(numbered("accessors", index) + ".sparse replaces element " +
                          std::to_string(element) + " of " + std::to_string(accessor.count));
        store(element, layout.values.data + i * layout.values.stride);
      }
  });
}

/// The elements of an accessor, each made of its bytes by `convert`.
template <class Item, class Convert>
void read_elements(const GltfModel& model, int index, std::vector<Item>& items, const Convert& convert) {
  const GltfAccessor& accessor = model.accessors[index];
  const Layout layout = lay_out(model, index);
  items.assign(accessor.count, Item{});
  if (accessor.view != -1)
    for (std::uint64_t i = 0; i < accessor.count; ++i)
      items[i] = convert(layout.base.data + i * layout.base.stride);
  if (accessor.sparse)
    read_sparse(accessor, index, layout,
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

bool is_number_type(int type) {
  return component_bytes(type) != 0;
}

bool is_position_type(int type) {
  return type != kUint32 && component_bytes(type) != 0;
}

}  // namespace

void check_positions(const GltfModel& model, int accessor) {
  check(model, accessor, 3, is_position_type, "POSITION");
}

void check_indices(const GltfModel& model, int accessor) {
  check(model, accessor, 1, is_index_type, "an index");
}

void read_positions(const GltfModel& model, int accessor, std::vector<Point>& points) {
  const bool normalized = model.accessors[accessor].normalized;
  with_component(model.accessors[accessor].component_type, [&](auto zero) {
    using T = decltype(zero);
    read_elements(model, accessor, points, [normalized](const char* bytes) {
      return Point{coordinate<T>(bytes, normalized), coordinate<T>(bytes + sizeof(T), normalized),
                   coordinate<T>(bytes + 2 * sizeof(T), normalized)};
    });
  });
}

std::vector<double> read_numbers(const GltfModel& model, int accessor, int components, const char* purpose) {
  check(model, accessor, components, is_number_type, purpose);
  const auto width = static_cast<std::size_t>(components);
  const bool normalized = model.accessors[accessor].normalized;
  std::vector<double> numbers;
  with_component(model.accessors[accessor].component_type, [&](auto zero) {
    using T = decltype(zero);
    std::vector<std::array<double, 16>> elements;
    read_elements(model, accessor, elements, [&](const char* bytes) {
      std::array<double, 16> element{};
      for (std::size_t k = 0; k < width; ++k) element[k] = coordinate<T>(bytes + k * sizeof(T), normalized);
      return element;
    });
    numbers.reserve(elements.size() * width);
    for (const auto& element : elements)
      numbers.insert(numbers.end(), element.begin(), element.begin() + components);
  });
  return numbers;
}

void read_indices(const GltfModel& model, int accessor, std::vector<std::uint32_t>& indices) {
  with_component(model.accessors[accessor].component_type, [&](auto zero) {
    using T = decltype(zero);
    if constexpr (std::is_unsigned_v<T>)
      read_elements(model, accessor, indices, [](const char* bytes) {
        const T index = load_number<T, std::endian::little>(bytes);
        return index == std::numeric_limits<T>::max() ? kNoVertex : std::uint32_t{index};
      });
  });
}

}  // namespace tandem::build
