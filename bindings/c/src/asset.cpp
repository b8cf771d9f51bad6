#include "handles.h"
#include "rows.h"

using namespace tandem;
using namespace tandem::c;

namespace {

CheckDepth depth_of(uint32_t check_depth) {
  return check_depth == TANDEM_CHECK_QUICK ? CheckDepth::quick : CheckDepth::full;
}

tandem_status checked(const void* data, size_t bytes, const tandem_memory_options& options, uint64_t* where,
                      AssetView& view) {
  const CheckResult result = check(data, bytes, depth_of(options.check_depth));
  if (where != nullptr) *where = result.where;
  view = result.asset;
  return to_c(result.status);
}

tandem_status take_bytes(tandem_asset& made, const void* data, size_t bytes,
                         const tandem_memory_options& options, uint64_t* where) {
  if (options.borrow == 0) {
    made.copy = allocate(bytes);
    if (made.copy == nullptr) return TANDEM_OUT_OF_MEMORY;
    std::memcpy(made.copy, data, bytes);
    return checked(made.copy, bytes, options, where, made.view);
  }
  const tandem_status status = checked(data, bytes, options, where, made.view);
  if (status != TANDEM_OK) return status;
  made.released = options.released;
  made.user = options.user;
  return TANDEM_OK;
}

}  // namespace

tandem_asset::~tandem_asset() {
  deallocate(copy);
  if (released != nullptr) released(user);
  tandem_asset_release(whole);
}

tandem_status tandem_asset_open(const char* path, const tandem_open_options* options,
                                const tandem_allocator* allocator, tandem_asset** asset, uint64_t* where) {
  if (where != nullptr) *where = 0;
  return create(allocator, asset, [&](tandem_asset& made) -> tandem_status {
    if (path == nullptr) return TANDEM_NULL_ARGUMENT;
    tandem_open_options read;
    if (const tandem_status status = read_struct(options, read); status != TANDEM_OK) return status;
    if (read.access > TANDEM_ACCESS_READ || read.check_depth > TANDEM_CHECK_QUICK || read.reserved != 0)
      return TANDEM_BAD_OPTION;
    const Access access = read.access == TANDEM_ACCESS_READ ? Access::read : Access::map;
    const Status opened = made.file.open(path, access, depth_of(read.check_depth));
    if (where != nullptr) *where = made.file.where();
    made.view = made.file.view();
    return to_c(opened);
  });
}

tandem_status tandem_asset_from_memory(const void* data, size_t bytes, const tandem_memory_options* options,
                                       const tandem_allocator* allocator, tandem_asset** asset,
                                       uint64_t* where) {
  if (where != nullptr) *where = 0;
  return create(allocator, asset, [&](tandem_asset& made) -> tandem_status {
    if (!is_there(data, bytes)) return TANDEM_NULL_ARGUMENT;
    tandem_memory_options read;
    if (const tandem_status status = read_struct(options, read); status != TANDEM_OK) return status;
    if (read.check_depth > TANDEM_CHECK_QUICK || read.borrow > 1 || read.reserved != 0)
      return TANDEM_BAD_OPTION;
    return take_bytes(made, data, bytes, read, where);
  });
}

void tandem_asset_retain(tandem_asset* asset) {
  if (asset != nullptr) asset->references.fetch_add(1, std::memory_order_relaxed);
}

void tandem_asset_release(tandem_asset* asset) {
  if (asset != nullptr && asset->references.fetch_sub(1, std::memory_order_acq_rel) == 1) delete asset;
}

const void* tandem_asset_data(const tandem_asset* asset, size_t* bytes) {
  const FileHeader* header = asset != nullptr ? asset->view.header : nullptr;
  if (bytes != nullptr) *bytes = header != nullptr ? header->file_bytes : 0;
  return header;
}

tandem_status tandem_asset_get_info(const tandem_asset* asset, tandem_asset_info* info) {
  if (asset == nullptr) return TANDEM_NULL_ARGUMENT;
  const FileHeader& header = *asset->view.header;
  tandem_asset_info filled = {};
  filled.level_count = static_cast<uint32_t>(asset->view.levels.size());
  filled.first_level = asset->view.first_level;
  filled.part_count = static_cast<uint32_t>(asset->view.parts.size());
  filled.file_bytes = header.file_bytes;
  filled.hash = header.hash;
  filled.source_faces = header.source_faces;
  filled.source_vertices = header.source_vertices;
  filled.rounding_error = header.rounding_error;
  std::copy_n(header.origin, 3, filled.origin);
  std::copy_n(header.lower, 3, filled.lower);
  std::copy_n(header.upper, 3, filled.upper);
  return write_struct(filled, info);
}

tandem_status tandem_asset_get_level(const tandem_asset* asset, uint32_t level, tandem_level* result) {
  if (asset == nullptr) return TANDEM_NULL_ARGUMENT;
  if (level >= asset->view.levels.size()) return TANDEM_UNKNOWN_LEVEL;
  const LevelView view = asset->view.level(level);
  tandem_level filled = {};
  filled.triangle_count = view.triangle_count;
  filled.block_count = view.block_count;
  filled.leaf_block_count = view.leaf_block_count;
  filled.depth = view.depth;
  filled.has_oriented_blocks = view.oriented_blocks != nullptr;
  filled.has_topology = view.topology != nullptr;
  filled.vertex_count = view.vertex_count;
  filled.component_count = view.component_count;
  filled.closed = view.closed;
  filled.error_bound = view.error_bound;
  filled.triangles = reinterpret_cast<const tandem_triangle*>(view.triangles);
  return write_struct(filled, result);
}

uint32_t tandem_asset_coarsest_level(const tandem_asset* asset, double tolerance) {
  return asset != nullptr ? asset->view.coarsest_level(tolerance) : 0;
}

tandem_status tandem_asset_levels_from(tandem_asset* asset, uint32_t first, uint32_t count,
                                       tandem_asset** levels) {
  if (levels != nullptr) *levels = nullptr;
  if (levels == nullptr || asset == nullptr) return TANDEM_NULL_ARGUMENT;
  if (first >= asset->view.levels.size()) return TANDEM_UNKNOWN_LEVEL;
  const AllocatorScope scope(asset->allocator);
  auto* const made = new (std::nothrow) tandem_asset;
  if (made == nullptr) return TANDEM_OUT_OF_MEMORY;
  made->allocator = asset->allocator;
  made->view = asset->view.levels_from(first, count != 0 ? count : kMaxLevels);
  tandem_asset_retain(made->whole = asset);
  *levels = made;
  return TANDEM_OK;
}

tandem_status tandem_asset_get_part(const tandem_asset* asset, uint32_t part, tandem_part* result) {
  if (asset == nullptr) return TANDEM_NULL_ARGUMENT;
  if (part >= asset->view.parts.size()) return TANDEM_UNKNOWN_LEVEL;
  const Part& found = asset->view.parts[part];
  const std::string_view name = asset->view.name_of(found), path = asset->view.path_of(found);
  tandem_part filled = {};
  filled.name = name.data();
  filled.name_bytes = name.size();
  filled.path = path.data();
  filled.path_bytes = path.size();
  filled.first_face = found.first_face;
  filled.face_count = found.face_count;
  return write_struct(filled, result);
}

const char* tandem_asset_provenance(const tandem_asset* asset, size_t* bytes) {
  const std::string_view json = asset != nullptr ? asset->view.provenance : std::string_view();
  if (bytes != nullptr) *bytes = json.size();
  return json.data();
}
