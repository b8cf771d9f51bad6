#include <fcntl.h>
#include <unistd.h>

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <cstring>

#include "tandem/kernels/detail/available_memory.h"

namespace tandem {
namespace {

constexpr std::uint64_t kUnknown = UINT64_MAX;

/// The beginning of a small file as text; empty where it cannot be read.
struct FileText {
  char text[8192] = {};

  explicit FileText(const char* path) {
    const int file = open(path, O_RDONLY | O_CLOEXEC);
    if (file < 0) return;
    const ssize_t length = read(file, text, sizeof text - 1);
    text[length > 0 ? length : 0] = '\0';
    close(file);
  }

  /// The number after `key`, which begins a line; the first of the file where there is no key.
  std::uint64_t number(const char* key = "") const {
    const std::size_t length = std::strlen(key);
    for (const char* line = text; line != nullptr && *line != '\0';) {
      if (std::strncmp(line, key, length) == 0) return number_at(line + length);
      line = std::strchr(line, '\n');
      if (line != nullptr) ++line;
    }
    return kUnknown;
  }

 private:
  static std::uint64_t number_at(const char* from) {
    char* end = nullptr;
    const std::uint64_t value = std::strtoull(from, &end, 10);
    return end != from ? value : kUnknown;  // a limit may be "max"
  }
};

/// The names that a version of control groups has for its files, and where they are.
struct GroupFiles {
  const char *folder, *limit, *usage, *reclaimable;
};
constexpr GroupFiles kVersion1 = {"/sys/fs/cgroup/memory", "memory.limit_in_bytes", "memory.usage_in_bytes",
                                  "total_inactive_file "};
constexpr GroupFiles kVersion2 = {"/sys/fs/cgroup", "memory.max", "memory.current", "inactive_file "};

std::uint64_t number_in(const char* folder, const char* file, const char* key = "") {
  char path[4096 + 32];
  std::snprintf(path, sizeof path, "%s/%s", folder, file);
  return FileText(path).number(key);
}

/// Returns what is left of the limit of one group. Pages of files that were not used lately can be had back.
std::uint64_t left_in(const char* folder, const GroupFiles& files) {
  const std::uint64_t limit = number_in(folder, files.limit), usage = number_in(folder, files.usage);
  if (limit == kUnknown || usage == kUnknown) return kUnknown;
  const std::uint64_t reclaimable = number_in(folder, "memory.stat", files.reclaimable);
  const std::uint64_t used = usage - std::min(usage, reclaimable == kUnknown ? 0 : reclaimable);
  return limit - std::min(limit, used);
}

/// Returns the least that is left of the limits of a group and of all groups above it.
std::uint64_t left_up_from(const char* root, const GroupFiles& files, const char* group, int length) {
  char folder[4096];
  std::snprintf(folder, sizeof folder, "%s%s%.*s", root, files.folder, length, group);
  char* const top = folder + std::min(std::strlen(root) + std::strlen(files.folder), sizeof folder - 1);
  std::uint64_t left = kUnknown;
  for (;;) {
    left = std::min(left, left_in(folder, files));
    char* const last = std::strrchr(top, '/');
    if (last == nullptr) return left;
    *last = '\0';
  }
}

/// Returns the least that is left of the limits of the groups that the process is in: lines such as
/// "4:memory:/a/b" (version 1) and "0::/a/b" (version 2).
std::uint64_t left_of_groups(const char* root) {
  char path[4096];
  std::snprintf(path, sizeof path, "%s/proc/self/cgroup", root);
  const FileText groups(path);
  std::uint64_t left = kUnknown;
  for (const char* line = groups.text; *line != '\0';) {
    const auto length = static_cast<int>(std::strcspn(line, "\n"));
    const char *names = std::strchr(line, ':'), *group = names ? std::strchr(names + 1, ':') : nullptr;
    if (group != nullptr && group < line + length) {
      const auto size = static_cast<int>(line + length - (group + 1));
      const bool is_memory = std::strncmp(names, ":memory:", 8) == 0;
      if (is_memory || group == names + 1)
        left = std::min(left, left_up_from(root, is_memory ? kVersion1 : kVersion2, group + 1, size));
    }
    line += length + (line[length] == '\n' ? 1 : 0);
  }
  return left;
}

}  // namespace

std::uint64_t available_memory_under(const char* root) {
  char path[4096];
  std::snprintf(path, sizeof path, "%s/proc/meminfo", root);
  const std::uint64_t kilobytes = FileText(path).number("MemAvailable:");
  const std::uint64_t of_machine = kilobytes == kUnknown ? kUnknown : 1024 * kilobytes;
  return std::min(of_machine, left_of_groups(root));
}

}  // namespace tandem
