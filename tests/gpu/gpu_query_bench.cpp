// Times the contact query on the GPU on lattices of cows, and compares its contacts with the CPU's.
// Usage: gpu_query_bench COW.bvh [check] [SIDE SPACING]...
#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <random>
#include <string>
#include <vector>

#include "tandem/kernels/broad_phase.h"
#include "tandem/kernels/contact_query.h"
#include "tandem/kernels/gpu_contact_query.h"
#include "tandem/runtime/map.h"
#include "tandem/runtime/upload.h"

namespace {

using namespace tandem;

template <typename Element>
Element* to_gpu(const std::vector<Element>& host) {
  void* memory = nullptr;
  if (cudaMalloc(&memory, std::max<std::size_t>(host.size(), 1) * sizeof(Element)) != cudaSuccess ||
      cudaMemcpy(memory, host.data(), host.size() * sizeof(Element), cudaMemcpyHostToDevice) != cudaSuccess) {
    std::printf("no GPU memory\n");
    std::exit(1);
  }
  return static_cast<Element*>(memory);
}

std::vector<Instance> lattice(int side, double spacing) {
  std::mt19937_64 random(1);
  const auto uniform = [&](double lo, double hi) {
    return lo + (hi - lo) * static_cast<double>(random() >> 11) * 0x1p-53;
  };
  std::vector<Instance> instances;
  for (int i = 0; i < side * side * side; ++i) {
    double q[4], length;
    do {
      length = 0;
      for (double& x : q) x = uniform(-1, 1), length += x * x;
    } while (length > 1 || length < 0.01);
    const double s = 2 / length, w = q[0], x = q[1], y = q[2], z = q[3];
    Instance instance = {0,
                         {{{1 - s * (y * y + z * z), s * (x * y - w * z), s * (x * z + w * y)},
                           {s * (x * y + w * z), 1 - s * (x * x + z * z), s * (y * z - w * x)},
                           {s * (x * z - w * y), s * (y * z + w * x), 1 - s * (x * x + y * y)}},
                          {0, 0, 0}}};
    const int cell[3] = {i % side, i / side % side, i / side / side};
    for (int k = 0; k < 3; ++k) instance.pose.translation[k] = spacing * (cell[k] + uniform(-0.25, 0.25));
    instances.push_back(instance);
  }
  return instances;
}

bool less(const Contact& x, const Contact& y) {
  return std::memcmp(&x, &y, sizeof x) < 0;
}

double median(std::vector<double> times) {
  std::sort(times.begin(), times.end());
  return times[times.size() / 2];
}

void run(const AssetView& view, const DeviceAsset& device, int side, double spacing, bool check) {
  const double length =
      std::max({view.header->upper[0] - view.header->lower[0], view.header->upper[1] - view.header->lower[1],
                view.header->upper[2] - view.header->lower[2]});
  const std::vector<Instance> instances = lattice(side, spacing * length);
  std::vector<WorldBox> boxes;
  for (const Instance& instance : instances) {
    boxes.push_back(world_box(for_stored_coordinates(instance.pose, view.header->origin), view.header->lower,
                              view.header->upper));
  }
  BroadPhase broad;
  if (broad.find_pairs(boxes) != Status::kOk) std::exit(1);
  const std::vector<ObjectPair> pairs(broad.pairs().begin(), broad.pairs().end());
  std::vector<std::uint32_t> asset(instances.size(), 0);
  std::vector<Pose> poses;
  for (const Instance& instance : instances) poses.push_back(instance.pose);
  const std::uint32_t count = static_cast<std::uint32_t>(pairs.size());
  const GpuInstances gpu_instances = {to_gpu(asset), to_gpu(poses),
                                      static_cast<std::uint32_t>(instances.size())};
  const GpuPairs gpu_pairs = {to_gpu(pairs), to_gpu(std::vector<std::uint32_t>{count}), count};
  std::printf("%d^3 cows, spacing %.2f: %u object pairs\n", side, spacing, count);

  ContactQuery cpu;
  if (cpu.set_assets({&view, 1}) != Status::kOk) std::exit(1);
  GpuContactQuery query;
  const GpuAsset gpu = gpu_asset(device.level(), *view.header);
  cudaStream_t stream;
  static_cast<void>(cudaStreamCreate(&stream));
  if (query.set_assets({&gpu, 1}, stream) != Status::kOk) std::exit(1);
  for (const QueryMode mode : {QueryMode::exact, QueryMode::fast, QueryMode::boxes}) {
    if (mode == QueryMode::boxes && side > 10 && std::getenv("BOXES") == nullptr) continue;
    const GpuQueryOptions options = {mode, false};
    int calls = 0;
    const Status status = query.find_contacts(gpu_instances, gpu_pairs, options, stream);
    if (status != Status::kOk) {
      std::printf("  %s %s\n", name(status), cudaGetErrorString(query.cuda_error()));
      continue;
    }
    std::vector<double> times;
    cudaEvent_t begin, end;
    static_cast<void>(cudaEventCreate(&begin));
    static_cast<void>(cudaEventCreate(&end));
    cudaGraph_t graph = nullptr;
    cudaGraphExec_t ready = nullptr;
    static_cast<void>(cudaStreamBeginCapture(stream, cudaStreamCaptureModeThreadLocal));
    Status queued = query.enqueue(gpu_instances, gpu_pairs, options, stream);
    static_cast<void>(cudaStreamEndCapture(stream, &graph));
    static_cast<void>(cudaGraphInstantiate(&ready, graph, 0));
    std::vector<double> graph_times;
    const int repeats = side > 10 ? 11 : 41;
    for (int i = 0; i < 2 * repeats; ++i, ++calls) {
      static_cast<void>(cudaEventRecord(begin, stream));
      if (i % 2 == 0)
        queued = query.enqueue(gpu_instances, gpu_pairs, options, stream);
      else
        static_cast<void>(cudaGraphLaunch(ready, stream));
      static_cast<void>(cudaEventRecord(end, stream));
      if (cudaStreamSynchronize(stream) != cudaSuccess || queued != Status::kOk) {
        std::printf("  failed: %s\n", cudaGetErrorString(cudaGetLastError()));
        std::exit(1);
      }
      float ms = 0;
      static_cast<void>(cudaEventElapsedTime(&ms, begin, end));
      (i % 2 == 0 ? times : graph_times).push_back(static_cast<double>(ms));
    }
    const GpuQueryReport& report = query.report();
    const QueryCounters& c = report.counters;
    std::printf(
        "  mode %d: stream %.4f ms, graph %.4f ms (best %.4f); block pairs %llu (%.2f G/s), candidates %llu, "
        "by float32 %llu, float64 %llu, exactly %llu, contacts %llu, complete %u, %.1f MB\n",
        static_cast<int>(mode), median(times), median(graph_times),
        *std::min_element(graph_times.begin(), graph_times.end()),
        static_cast<unsigned long long>(c.block_pairs),
        static_cast<double>(c.block_pairs) / median(graph_times) * 1e-6,
        static_cast<unsigned long long>(c.candidates), static_cast<unsigned long long>(c.decided_by_float32),
        static_cast<unsigned long long>(c.decided_by_float64),
        static_cast<unsigned long long>(c.decided_exactly), static_cast<unsigned long long>(c.contacts),
        report.complete, static_cast<double>(query.bytes()) * 1e-6);
    if (!check) continue;
    std::vector<Contact> found(report.contacts);
    static_cast<void>(
        cudaMemcpy(found.data(), query.contacts(), found.size() * sizeof(Contact), cudaMemcpyDeviceToHost));
    std::sort(found.begin(), found.end(), less);
    QueryOptions cpu_options;
    cpu_options.mode = mode;
    cpu_options.threads = 16;
    const auto start = std::chrono::steady_clock::now();
    if (cpu.find_contacts(instances, pairs, cpu_options) != Status::kOk) std::exit(1);
    const double ms =
        std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start).count();
    std::vector<Contact> expected(cpu.contacts().begin(), cpu.contacts().end());
    std::sort(expected.begin(), expected.end(), less);
    std::printf("    CPU %.1f ms (16 threads), block pairs %llu, candidates %llu, contacts %zu: %s\n", ms,
                static_cast<unsigned long long>(cpu.counters().block_pairs),
                static_cast<unsigned long long>(cpu.counters().candidates), expected.size(),
                found == expected ? "EQUAL" : "DIFFERENT");
    std::fflush(stdout);
  }
}

}  // namespace

int main(int argc, char** argv) {
  MappedAsset asset;
  if (argc < 2 || asset.open(argv[1]) != Status::kOk) return 2;
  DeviceAsset device;
  if (device.upload(asset.view(), nullptr) != Status::kOk) return 1;
  bool check = false;
  for (int i = 2; i < argc; ++i) {
    if (std::string(argv[i]) == "check") {
      check = true;
    } else if (i + 1 < argc) {
      run(asset.view(), device, std::atoi(argv[i]), std::atof(argv[i + 1]), check);
      ++i;
    }
  }
}
