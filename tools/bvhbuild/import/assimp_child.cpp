#include "assimp_child.h"

#include <csignal>
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

std::string crash(int signal) {
  if (signal == SIGKILL) return "assimp was killed (signal 9); perhaps the machine ran out of memory";
  return "assimp crashed (signal " + std::to_string(signal) + ")";
}

std::string explanation(ChildEnd end, int signal, const ImportOptions& options) {
  switch (end) {
    case ChildEnd::out_of_time:
      return "assimp did not finish within " + short_number(options.time_limit_seconds) + " s (--time-limit)";
    case ChildEnd::out_of_memory:
      return "assimp needed more than " + byte_size(options.memory_limit_bytes) +
             " of memory (--memory-limit)";
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
  const auto work = [&path](const LimitedChild::Sink& sink) { write_message(read_assimp_scene(path), sink); };
  const std::string no_child = child.start({options.time_limit_seconds, options.memory_limit_bytes}, work);
  if (!no_child.empty()) return read_failure(no_child);
  ReadResult result;
  const auto source = [&child](void* to, std::size_t count) { return child.read(to, count); };
  if (read_message(source, options.memory_limit_bytes, result)) return result;
  const ChildEnd end = child.finish();
  return read_failure(explanation(end, child.signal(), options));
}

}  // namespace tandem::build
