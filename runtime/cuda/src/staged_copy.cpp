#include "staged_copy.h"

#include <atomic>
#include <cstring>
#include <exception>
#include <thread>

#include "tandem/formats/gpu_memory.h"
#include "tandem/formats/gpu_stream.h"

namespace tandem {
namespace {

// The state of one copy. Threads share next_ and error_, which are atomic, and what is constant. Pinned
// memory and events belong to the thread that made them. CUDA's functions may be called from any thread.
class StagedCopy {
 public:
  StagedCopy(std::span<const Piece> pieces, std::uint64_t bytes, std::uint64_t chunk_bytes, unsigned char* to,
             cudaStream_t stream)
      : pieces_(pieces), bytes_(bytes), chunk_bytes_(chunk_bytes), to_(to), stream_(stream) {
    succeeds(cudaGetDevice(&device_));
  }

  cudaError_t run(std::uint32_t threads) {
    if (threads > 0) stage_by(threads);
    copy_rest();
    return error_;
  }

 private:
  void stage_by(std::uint32_t threads) {
    std::thread others[kMostStagingThreads - 1];
    std::uint32_t started = 0;
    try {
      for (; started + 1 < threads; ++started) others[started] = std::thread([this] { stage(); });
    } catch (const std::exception&) {  // the system's refusal: fewer threads do it
    }
    stage();
    for (std::uint32_t i = 0; i < started; ++i) others[i].join();
  }

  // The work of one thread. It takes no chunk before it has all it needs, so what it cannot do is left to
  // others, and to copy_rest().
  void stage() {
    PinnedArray<unsigned char> chunks;
    GpuEvent copied[2];
    if (cudaSetDevice(device_) != cudaSuccess || chunks.reserve(2 * chunk_bytes_) != cudaSuccess) return;
    for (GpuEvent& event : copied) {
      if (event.create() != cudaSuccess) return;
    }
    for (int turn = 0; error_ == cudaSuccess; turn ^= 1) {
      const std::uint64_t begin = next_.fetch_add(chunk_bytes_);
      if (begin >= bytes_) break;
      if (!succeeds(copied[turn].wait())) break;
      copy_chunk(begin, chunks.data() + (turn == 0 ? 0 : chunk_bytes_));
      succeeds(copied[turn].record(stream_));
    }
    for (const GpuEvent& event : copied) succeeds(event.wait());  // before the chunks are freed
  }

  void copy_chunk(std::uint64_t begin, unsigned char* chunk) {
    const std::uint64_t end = std::min(begin + chunk_bytes_, bytes_);
    for_each_part(pieces_, begin, end, [&](const unsigned char* from, std::uint64_t size, std::uint64_t at) {
      std::memcpy(chunk + (at - begin), from, size);
    });
    succeeds(cudaMemcpyAsync(to_ + begin, chunk, end - begin, cudaMemcpyHostToDevice, stream_));
  }

  // Copies what no thread took, which is all where none was asked for.
  void copy_rest() {
    for_each_part(pieces_, next_, bytes_,
                  [&](const unsigned char* from, std::uint64_t size, std::uint64_t at) {
                    if (error_ != cudaSuccess) return;
                    succeeds(cudaMemcpyAsync(to_ + at, from, size, cudaMemcpyHostToDevice, stream_));
                  });
    succeeds(cudaStreamSynchronize(stream_));
  }

  // Keeps the first error.
  bool succeeds(cudaError_t error) {
    cudaError_t none = cudaSuccess;
    if (error != cudaSuccess) error_.compare_exchange_strong(none, error);
    return error == cudaSuccess;
  }

  const std::span<const Piece> pieces_;
  const std::uint64_t bytes_, chunk_bytes_;
  unsigned char* const to_;
  const cudaStream_t stream_;
  int device_ = 0;
  std::atomic<std::uint64_t> next_ = 0;  // the first byte that no thread has taken
  std::atomic<cudaError_t> error_ = cudaSuccess;
};

}  // namespace

cudaError_t copy_pieces(std::span<const Piece> pieces, std::uint64_t bytes, const Staging& staging,
                        unsigned char* to, cudaStream_t stream) {
  return StagedCopy(pieces, bytes, staging.chunk_bytes, to, stream).run(staging.threads);
}

}  // namespace tandem
