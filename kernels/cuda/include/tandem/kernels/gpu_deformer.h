#pragma once
#include <cuda_runtime_api.h>

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>

#include "tandem/formats/gpu_memory.h"
#include "tandem/formats/status.h"
#include "tandem/kernels/gpu_arrays.h"

namespace tandem {

namespace gpu {
template <typename Report>
struct HostOf;
}

/// The positions of some bodies, in GPU memory as what they point to: of each body the x, y, z of each source
/// vertex, in the file's coordinates, as many as FileHeader::source_vertices.
struct GpuPositions {
  const float* const* in_float32 = nullptr;   ///< of each body, or null; the whole array may be null
  const double* const* in_float64 = nullptr;  ///< the same; looked at where a body has none in float32
};

/// Owns the records of a list of assets.
class GpuAssetList {
 public:
  /// Copies the list to the current device behind what `stream` holds, and waits for that. positions: by
  /// which assets may be deformed. Result: kOk, kOutOfRange (2^32 - 1 assets), kOutOfMemory, or another that
  /// status_of() of gpu_status.h names.
  Status set(std::span<const GpuAsset> assets, PositionTypes positions, cudaStream_t stream);

  const GpuAssetRecords& records() const { return records_; }
  std::size_t bytes() const { return assets_.bytes() + bounds_.bytes(); }

 private:
  GpuArray<GpuAsset> assets_;
  GpuArray<AssetBounds> bounds_;
  GpuAssetRecords records_ = {};
};

/// The outcome of a call.
struct GpuDeformReport {
  Status status;  ///< kOk, or kOutOfRange
  std::uint32_t
      body;  ///< the first with a coordinate that is NaN or beyond kMaxCoordinate, and the first vertex
  std::uint64_t where;
};

/// Deforms bodies on the GPU: it owns a copy of the tree of each, and gives that the positions of the body's
/// source vertices, which lie in GPU memory. Records of assets name these copies, so queries that follow()
/// the records, and a broad phase that is given their bounds, are about the deformed bodies. Boxes are those
/// of Scene::deform(), and oriented blocks have the same along the axes of the mesh. The same positions give
/// the same bytes.
///
/// Throws nothing. Movable, not copyable. Several deformers may write to the records of one list, each its
/// own.
class GpuDeformer {
 public:
  GpuDeformer();
  GpuDeformer(GpuDeformer&&) noexcept;
  GpuDeformer& operator=(GpuDeformer&&) noexcept;
  ~GpuDeformer();  ///< waits for the device

  /// Names the bodies that deform: each is an asset of the list, whose tree is copied on the current device
  /// behind what `stream` holds. The record of the asset names the copy from then on, in the shape that it
  /// has in the file. Returns when that is done. Holds, for each body, the bytes of its triangles, blocks and
  /// oriented blocks, and 72 for each triangle where the records say that positions may be in float64.
  /// Takes the trees back to the CPU once for each that is another.
  ///
  /// bodies: ascending numbers in the list. records: of the list, in GPU memory; they outlive the deformer.
  /// What the assets' trees point to, but for what is copied, outlives the queries. Result: kOk;
  /// kUnknownAsset; kNoSourceVertices, where the file has none or they were not uploaded; kOutOfRange (2^32 -
  /// 1 blocks or thread blocks in all); kOutOfMemory, kOutOfGpuMemory, or another that status_of() of
  /// gpu_status.h names. After an error no body deforms.
  Status begin(std::span<const GpuAsset> assets, std::span<const std::uint32_t> bodies,
               const GpuAssetRecords& records, cudaStream_t stream);

  /// Queues a call behind what `stream` holds, which may be captured into a graph: it neither waits for the
  /// GPU nor allocates. All bodies take their new shapes by as many kernels as one body of the most triangles
  /// does: four of up to some 60,000.
  ///
  /// A body that has no positions stays as it is. A body whose positions are bad stays as it is, too, and the
  /// first is reported. Positions in float64 take a kernel more. Where all of a body are float32 numbers they
  /// count as these. Result: kOk; kNotFloat32, where there are positions in float64 and begin() was not told
  /// of such; or what CUDA said.
  Status enqueue(const GpuPositions& positions, cudaStream_t stream);

  /// Deforms the bodies, and waits for the end. Result: that of the report, or of a call that failed.
  Status deform(const GpuPositions& positions, cudaStream_t stream);

  std::uint32_t bodies() const;

  /// Returns the deformed tree of a body, with pointers into GPU memory. `precise` says where the positions
  /// in float64 go, if such may be given; whether they count is in the record.
  LevelView level(std::uint32_t body) const;

  const GpuDeformReport* device_report() const;  ///< in GPU memory, where it is written when the call ends

  /// Returns the report, in CPU memory. Condition: the stream has come to the end of the call.
  const GpuDeformReport& report() const;

  std::size_t bytes() const;  ///< GPU memory held
  cudaError_t cuda_error() const;

 private:
  std::unique_ptr<gpu::HostOf<GpuDeformReport>> host_;  ///< null where there was no memory for it
};

}  // namespace tandem
