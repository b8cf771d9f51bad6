#pragma once
#include <cuda_runtime_api.h>

#include <cstddef>
#include <memory>
#include <span>

#include "tandem/formats/status.h"
#include "tandem/kernels/gpu_arrays.h"

namespace tandem {

namespace gpu {
template <typename Report>
struct HostOf;  // the memory of the question that has this report
}

/// The options of a question whose room does not depend on any.
struct GpuNoOptions {};

/// The base of all questions on a GPU. Each of them adds functions that queue a call (enqueue) and that
/// repeat it until there is room for all of its results (find), and its rows, which lie in GPU memory and are
/// valid until the next reserve().
///
/// enqueue() neither waits for the GPU nor allocates, and may be captured into a graph; the arrays that it is
/// given must stay until the call is done. Its Result tells what the CPU finds wrong: kOk, kCudaFailed, or
/// kOutOfGpuMemory, where CUDA loads a kernel at its first launch and the GPU is full. What the GPU finds
/// wrong is in the report.
///
/// find enqueues a call and waits for it; where room was too small, it makes room and starts again until the
/// call is complete: in a steady state once. Result: that of the report, or of a call that failed;
/// kOutOfRange where the room in given arrays of pairs was too small.
///
/// Throws nothing. Movable, not copyable. An object answers one call at a time: enqueue the next on the same
/// stream, or when the last has ended. Several objects can run side by side.
///
/// Capacity: how many of each thing there is room for, or how many there have to be. Report: the outcome of a
/// call. Options: those that the room depends on.
template <typename Capacity, typename Report, typename Options = GpuNoOptions>
class GpuQuestion {
 public:
  GpuQuestion();
  GpuQuestion(GpuQuestion&&) noexcept;
  GpuQuestion& operator=(GpuQuestion&&) noexcept;
  ~GpuQuestion();  ///< waits for the device

  /// Makes room for at least so much on the current device, waiting for it where memory grows. `options`:
  /// those of the calls to come. Result: kOk, kOutOfGpuMemory, kOutOfMemory, kCudaFailed, and what the
  /// question itself names; after an error there is the room that there was, or less. Condition: set_assets()
  /// of a question that has it.
  Status reserve(const Capacity& wanted, const Options& options = {});

  const Report* device_report() const;  ///< in GPU memory, where it is written when the call ends

  /// Returns the report, in CPU memory. Condition: the stream has come to the end of the call.
  const Report& report() const;

  Capacity capacity() const;
  std::size_t bytes() const;  ///< GPU memory held
  cudaError_t cuda_error() const;

 protected:
  std::unique_ptr<gpu::HostOf<Report>> host_;  ///< null where there was no memory for it
};

/// A question whose instances refer to a list of assets.
template <typename Capacity, typename Report, typename Options = GpuNoOptions>
class GpuAssetQuestion : public GpuQuestion<Capacity, Report, Options> {
 public:
  /// Names the assets that instances refer to, on the current device, after what `stream` holds: copies what
  /// is to be known of them, and returns when that is done. What the trees point to must outlive the calls.
  /// Result: kOk; kNoAxisAlignedBlocks, kNoOrientedBlocks or kNoTopology, where an asset lacks what the
  /// question asks for; kOutOfRange (2^32 - 1 assets); kOutOfGpuMemory, kOutOfMemory, or another that
  /// status_of() of gpu_status.h names: kNoGpu, kDriverTooOld, kGpuNotSupported, kCudaFailed.
  Status set_assets(std::span<const GpuAsset> assets, cudaStream_t stream);

  /// Says that assets deform: calls to come take what is to be known of them from these records of the list,
  /// in GPU memory, as a GpuDeformer writes them there. No records, as after set_assets(): they take what
  /// set_assets() was given. Result: kOk; kDeformed, where the question is not offered for deformed assets;
  /// or kNotFloat32, where it is not offered for positions in float64, and the records say that there may be
  /// such. After an error nothing has changed. Condition: set_assets().
  Status follow(const GpuAssetRecords& records);
};

}  // namespace tandem
