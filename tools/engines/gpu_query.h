#pragma once
#include <cstddef>
#include <cstdint>
#include <span>
#include <stdexcept>
#include <string>
#include <vector>

#include "scenes/scene_file.h"

namespace tandem::bench {

/// What finds the contacts.
enum class GpuEngine : std::uint8_t {
  tandem,      ///< GpuContactQuery
  paper,       ///< PaperEngine, the yardstick
  paper_bits,  ///< the same with bit arrays of flags
};

struct GpuQueryRequest {
  GpuEngine engine = GpuEngine::tandem;
  QueryMode mode = QueryMode::exact;
  bool first_contact_only = false;
  bool sorted = false;     ///< pairs and contacts on the GPU, as a contacts file has them
  bool traversal = false;  ///< time that alone too
  std::uint32_t repeats = 1;
};

/// Seconds of a step, one for each repeat.
using Seconds = std::vector<double>;

/// What a GPU found, on the CPU, and how long it took there.
struct GpuAnswer {
  std::vector<ObjectPair> pairs;  ///< sorted
  std::vector<Contact> contacts;  ///< of rows of pairs; in no order unless they were to be sorted
  QueryCounters counters;
  std::string gpu;              ///< name of the device
  double upload = 0;            ///< seconds for assets and instances, allocation included
  Seconds broad_phase, narrow;  ///< object pairs, empty where they are given; contacts
  Seconds whole;                ///< both, and what it takes to start them
  Seconds traversal;            ///< of the same object pairs in mode boxes, nothing stored
  std::size_t bytes = 0;        ///< of GPU memory: assets, instances, and the room of both steps
  std::size_t bytes_bound = 0;  ///< what the rule of docs/gpu.md says they are at most
  std::size_t bytes_taken = 0;  ///< by the driver's count; what CUDA keeps for kernels included
};

/// No GPU can be used, or it has too little memory; what() says why.
struct GpuError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// Finds the contacts of a scene on the current GPU. `given`: normalised object pairs, null where the GPU is
/// to find them. The query runs until everything has room, then again for each repeat, timed by events: as a
/// CUDA graph that is replayed, but for the paper's engine, which asks the CPU after each level. Throws
/// GpuError; FileError: an instance or pair is wrong, as on the CPU; std::runtime_error: CUDA failed.
/// Condition: this program has CUDA; none of the flags but with GpuEngine::tandem.
GpuAnswer query_on_gpu(const std::string& path, const Scene& scene, const std::vector<ObjectPair>* given,
                       const GpuQueryRequest& request);

/// Throws what a status other than kOk calls for. `where`: the instance or pair that is to blame.
[[noreturn]] void refuse(const std::string& scene, Status status, std::uint64_t where);

}  // namespace tandem::bench
