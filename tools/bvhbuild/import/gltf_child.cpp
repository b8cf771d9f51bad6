#include "import/gltf_child.h"

#include <csignal>
#include <string>

#include "import/limited_child.h"
#include "import/mesh_message.h"
#include "import/read_gltf.h"

namespace tandem::build {
namespace {

std::string explanation(ChildEnd end, int signal) {
  switch (end) {
    case ChildEnd::out_of_time:
      return "tinygltf did not finish within the time limit (--time-limit)";
    case ChildEnd::out_of_memory:
      return "reading it with tinygltf needs more memory than the limit allows (--memory-limit)";
    case ChildEnd::crashed:
      return signal == SIGKILL ? "tinygltf was killed (signal 9); perhaps the machine ran out of memory"
                               : "tinygltf crashed (signal " + std::to_string(signal) + ")";
    case ChildEnd::finished:
    case ChildEnd::lost:
      break;
  }
  return "tinygltf ended without a usable result";
}

}  // namespace

ReadResult read_in_gltf_child(const std::filesystem::path& path, const ImportOptions& options) {
  LimitedChild child;
  const std::uint64_t most_bytes = options.memory_limit_bytes;
  const auto work = [&path, most_bytes](const LimitedChild::Sink& sink) {
    write_message(read_gltf(path, most_bytes), sink);
  };
  const std::string no_child = child.start({options.time_limit_seconds, most_bytes}, work);
  if (!no_child.empty()) return read_failure(no_child);
  ReadResult result;
  const auto source = [&child](void* to, std::size_t count) { return child.read(to, count); };
  if (read_message(source, most_bytes, result)) return result;
  const ChildEnd end = child.finish();
  return read_failure(explanation(end, child.signal()));
}

}  // namespace tandem::build
