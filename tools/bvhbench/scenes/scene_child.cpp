#include "scene_child.h"

#include <filesystem>
#include <new>

#include "common/limited_child.h"

namespace tandem::bench {
namespace {

// A scene on its way through the pipe: arrays, each led by the number of its elements.
using Sink = LimitedChild::Sink;

template <typename Array>
void send(const Sink& sink, const Array& array) {
  const std::uint64_t count = array.size();
  sink(&count, sizeof count);
  sink(array.data(), count * sizeof(*array.data()));
}

// Without the zeros that a string may hold: no path does, and nothing else that is sent.
void send(const Sink& sink, const std::vector<std::string>& strings) {
  std::string all;
  for (const std::string& text : strings) all.append(text.c_str()) += '\0';
  send(sink, all);
}

void send(const Sink& sink, const SceneDescription& scene) {
  send(sink, scene.assets);
  send(sink, scene.instances);
  send(sink, scene.level);
  send(sink, scene.filter.motion);
  send(sink, scene.filter.group);
  send(sink, scene.filter.mask);
  send(sink, scene.filter.excluded);
  const std::uint8_t pairs = scene.pairs.has_value(), poses = scene.poses.has_value();
  sink(&pairs, 1);
  if (pairs != 0) send(sink, *scene.pairs);
  sink(&poses, 1);
  if (poses == 0) return;
  send(sink, scene.poses->geometry);
  send(sink, scene.poses->stream);
  send(sink, scene.poses->depth);
}

// The error that there was, or nothing, and then the scene.
void send_outcome(const Sink& sink, const std::string& path,
                  const std::function<SceneDescription(const std::string&)>& read) {
  SceneDescription scene;
  std::string error;
  try {
    scene = read(path);
  } catch (const FileError& defect) {
    error = defect.what();
  }
  send(sink, error);
  if (error.empty()) send(sink, scene);
}

// Reads what was sent; each function returns false where the child ended before.
class Receiver {
 public:
  Receiver(LimitedChild& child, std::uint64_t most_bytes) : child_(child), most_bytes_(most_bytes) {}

  template <typename Array>
  bool receive(Array& array) {
    std::uint64_t count = 0;
    if (!child_.read(&count, sizeof count) || count > most_bytes_ / sizeof(*array.data())) return false;
    array.resize(count);
    return child_.read(array.data(), count * sizeof(*array.data()));
  }

  bool receive(std::vector<std::string>& strings) {
    std::string all;
    if (!receive(all)) return false;
    for (std::size_t begin = 0; begin < all.size();) {
      strings.emplace_back(&all[begin]);
      begin += strings.back().size() + 1;
    }
    return true;
  }

  bool receive(PoseNotes& notes) {
    return receive(notes.geometry) && receive(notes.stream) && receive(notes.depth);
  }

  bool receive(SceneFilter& filter) {
    return receive(filter.motion) && receive(filter.group) && receive(filter.mask) &&
           receive(filter.excluded);
  }

  bool receive(SceneDescription& scene) {
    return receive(scene.assets) && receive(scene.instances) && receive(scene.level) &&
           receive(scene.filter) && receive(scene.pairs) && receive(scene.poses);
  }

  template <typename Part>
  bool receive(std::optional<Part>& part) {
    std::uint8_t given = 0;
    if (!child_.read(&given, 1)) return false;
    return given == 0 || receive(part.emplace());
  }

 private:
  LimitedChild& child_;
  std::uint64_t most_bytes_;
};

std::string explanation(ChildEnd end) {
  switch (end) {
    case ChildEnd::out_of_time:
      return "reading it takes too long";
    case ChildEnd::out_of_memory:
      return "reading it takes more memory than a file of its size should";
    case ChildEnd::crashed:
      return "damaged: the HDF5 library crashed on it";
    case ChildEnd::finished:
    case ChildEnd::lost:
      break;
  }
  return "damaged: the HDF5 library gave up on it";
}

// A gigabyte serves any scene; more is for files that are large themselves.
std::uint64_t memory_for(const std::string& path) {
  std::error_code error;
  const std::uintmax_t bytes = std::filesystem::file_size(path, error);
  return (std::uint64_t{1} << 30) + (error ? 0 : 16 * bytes);
}

}  // namespace

SceneDescription read_in_child(const std::string& path,
                               const std::function<SceneDescription(const std::string&)>& read) {
  constexpr double kSeconds = 300;
  const std::uint64_t memory = memory_for(path);
  LimitedChild child;
  const auto work = [&](const Sink& sink) { send_outcome(sink, path, read); };
  const std::string no_child = child.start({kSeconds, memory}, work);
  if (!no_child.empty()) throw std::runtime_error(no_child);
  Receiver receiver(child, memory);
  std::string error;
  SceneDescription scene;
  if (!receiver.receive(error)) throw FileError(path + ": " + explanation(child.finish()));
  if (!error.empty()) throw FileError(error);
  if (!receiver.receive(scene)) throw FileError(path + ": " + explanation(child.finish()));
  return scene;
}

}  // namespace tandem::bench
