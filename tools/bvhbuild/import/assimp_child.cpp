#include "assimp_child.h"

#include <algorithm>
#include <csignal>
#include <cstdint>
#include <cstdio>

#include "assimp_scene.h"
#include "common/limited_child.h"
#include "mesh_message.h"

namespace tandem::build {
namespace {

std::string short_number(double value) {
  char text[32];
  std::snprintf(text, sizeof text, "%.4g", value);
  return text;
}

std::string byte_size(std::uint64_t bytes) {
  constexpr std::uint64_t kGiB = std::uint64_t{1} << 30;
  if (bytes >= kGiB) return short_number(static_cast<double>(bytes) / static_cast<double>(kGiB)) + " GiB";
  return short_number(static_cast<double>(bytes) / (1 << 20)) + " MiB";
}

/// Address space that assimp may take for a file. Some formats let nodes repeat nodes, so that 2 kB of
/// COLLADA make 2^30 of them. OBJ and COLLADA files of 9 MB that repeat nothing need 16 to 18 times their
/// bytes.
std::uint64_t memory_for(const std::filesystem::path& path, const ReadLimits& limits) {
  constexpr std::uint64_t kBytesOfAnElement = 192;
  constexpr std::uint64_t kAlways = std::uint64_t{64} << 20;
  constexpr std::uint64_t kNoBound = UINT64_MAX / kBytesOfAnElement / 4;
  std::error_code no_size;
  const std::uint64_t bytes = std::min(std::filesystem::file_size(path, no_size), kNoBound);
  return std::min(limits.memory_bytes,
                  kAlways + kBytesOfAnElement * (bytes + std::min(limits.expansion, kNoBound)));
}

std::string crash(int signal) {
  if (signal == SIGKILL) return "assimp was killed (signal 9); perhaps the machine ran out of memory";
  return "assimp crashed (signal " + std::to_string(signal) + ")";
}

std::string explanation(ChildEnd end, int signal, std::uint64_t memory, const ImportOptions& options) {
  switch (end) {
    case ChildEnd::out_of_time:
      return "assimp did not finish within " + short_number(options.time_limit_seconds) + " s (--time-limit)";
    case ChildEnd::out_of_memory:
      return "assimp needed more than " + byte_size(memory) + " of memory (" +
             (memory < options.limits.memory_bytes ? "--expansion-limit)" : "--memory-limit)");
    case ChildEnd::crashed:
      return crash(signal);
    case ChildEnd::finished:
    case ChildEnd::lost:
      break;
  }
  return "assimp ended without a usable result";
}

}  // namespace

ReadResult read_in_assimp_child(const std::filesystem::path& path, const ImportOptions& options) {
  LimitedChild child;
  const std::uint64_t memory = memory_for(path, options.limits);
  const auto work = [&](const LimitedChild::Sink& sink) {
    write_message(read_assimp_scene(path, options.limits), sink);
  };
  const std::string no_child = child.start({options.time_limit_seconds, memory}, work);
  if (!no_child.empty()) return read_failure(no_child);
  ReadResult result;
  const auto source = [&child](void* to, std::size_t count) { return child.read(to, count); };
  if (read_message(source, memory, result)) return result;
  const ChildEnd end = child.finish();
  return read_failure(explanation(end, child.signal(), memory, options));
}

}  // namespace tandem::build
