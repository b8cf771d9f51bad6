#include <algorithm>
#include <bit>
#include <cub/device/device_radix_sort.cuh>

#include "kernels/common/cub_code.cuh"
#include "kernels/contact/gpu_query_data.h"

// Contacts in the order of a contacts file. A radix sort is stable, so three in a row do it: by triangles, by
// faces, by pair, each of as many bits as the scene's numbers have. Sorted are places, as many as there is
// room for, since the CPU does not know the contacts' number: those past it come last.
namespace tandem::gpu {
namespace {

using Key = unsigned long long;
constexpr Key kLast = ~0ull;
constexpr unsigned kThreads = 256;

enum class By { triangles, faces, pair };

struct Bits {
  int triangle, face, pair;
};

int bits_below(std::uint64_t count) {
  return static_cast<int>(std::bit_width(std::max<std::uint64_t>(count, 2) - 1));
}

/// Numbers of pairs leave one number that is no pair's, of all ones.
Bits bits_of(const SortingRoom& room, std::uint32_t pairs) {
  return {bits_below(room.most_triangles), std::min(bits_below(room.most_faces), 32),
          static_cast<int>(std::bit_width(std::max(pairs, 1u)))};
}

/// Two rows of keys and of places: those sorted and the others.
struct Rows {
  cub::DoubleBuffer<Key> keys;
  cub::DoubleBuffer<std::uint32_t> places;
};

Rows rows_of(const SortingRoom& room, std::uint64_t count) {
  auto* keys = reinterpret_cast<Key*>(room.out);
  const std::uint64_t row = (count + 31) / 32 * 32;
  return {{keys, keys + row}, {room.order, room.order + count}};
}

/// The order of faces within an instance itself, as a contacts file has it.
__device__ Contact in_file_order(const QueryArgs& args, const Contact& c) {
  const PairRecord& record = args.pairs[c.pair];
  if (record.instance_a != record.instance_b || c.face_a <= c.face_b) return c;
  return {c.pair, c.triangle_b, c.triangle_a, c.face_b, c.face_a};
}

template <By kBy>
__global__ void __launch_bounds__(kThreads)
    make_keys(const __grid_constant__ QueryArgs args, Bits bits, Key* keys, std::uint32_t* places) {
  const std::uint64_t i = static_cast<std::uint64_t>(blockIdx.x) * kThreads + threadIdx.x;
  if (i >= args.capacity.contacts) return;
  const std::uint64_t count = args.state->report.contacts;
  const std::uint32_t place = kBy == By::triangles ? static_cast<std::uint32_t>(i) : places[i];
  Key key = kLast;
  if (place < count) {
    Contact contact = args.contacts[place];
    if (kBy == By::triangles) args.contacts[place] = contact = in_file_order(args, contact);
    if (kBy == By::triangles)
      key = static_cast<Key>(contact.triangle_a) << bits.triangle | contact.triangle_b;
    if (kBy == By::faces) key = static_cast<Key>(contact.face_a) << bits.face | contact.face_b;
    if (kBy == By::pair) key = contact.pair;
  }
  keys[i] = key;
  if (kBy == By::triangles) places[i] = place;
}

__global__ void __launch_bounds__(kThreads)
    gather(const __grid_constant__ QueryArgs args, const std::uint32_t* places, Contact* out) {
  const std::uint64_t i = static_cast<std::uint64_t>(blockIdx.x) * kThreads + threadIdx.x;
  if (i < args.state->report.contacts) out[i] = args.contacts[places[i]];
}

unsigned blocks_for(std::uint64_t count) {
  return static_cast<unsigned>((count + kThreads - 1) / kThreads);
}

template <By kBy>
cudaError_t sort(const QueryArgs& args, const SortingRoom& room, const Bits& bits, Rows& rows,
                 cudaStream_t stream) {
  const std::uint64_t count = args.capacity.contacts;
  const int end = kBy == By::triangles ? 2 * bits.triangle : kBy == By::faces ? 2 * bits.face : bits.pair;
  make_keys<kBy>
      <<<blocks_for(count), kThreads, 0, stream>>>(args, bits, rows.keys.Current(), rows.places.Current());
  if (const cudaError_t error = cudaGetLastError(); error != cudaSuccess) return error;
  std::size_t bytes = room.scratch_bytes;
  return cub::DeviceRadixSort::SortPairs(room.scratch, bytes, rows.keys, rows.places, count, 0, end, stream);
}

}  // namespace

cudaError_t sorting_bytes(std::uint64_t contacts, std::size_t& bytes) {
  if (const cudaError_t error = load_cub_code(); error != cudaSuccess) return error;
  Rows rows = {};
  return cub::DeviceRadixSort::SortPairs(nullptr, bytes, rows.keys, rows.places, contacts);
}

cudaError_t sort_contacts(const QueryArgs& args, const SortingRoom& room, cudaStream_t stream) {
  const std::uint64_t count = args.capacity.contacts;
  if (count == 0) return cudaSuccess;
  const Bits bits = bits_of(room, args.capacity.pairs);
  Rows rows = rows_of(room, count);
  cudaError_t error = sort<By::triangles>(args, room, bits, rows, stream);
  if (error == cudaSuccess) error = sort<By::faces>(args, room, bits, rows, stream);
  if (error == cudaSuccess) error = sort<By::pair>(args, room, bits, rows, stream);
  if (error != cudaSuccess) return error;
  // The keys, which lie where the contacts go, are done with.
  gather<<<blocks_for(count), kThreads, 0, stream>>>(args, rows.places.Current(), room.out);
  return cudaGetLastError();
}

}  // namespace tandem::gpu
