#include "import_samples.h"

#include <algorithm>
#include <cmath>

#include "bvhbuild/import/animation.h"
#include "common/number_words.h"
#include "common/path_text.h"
#include "tandem/formats/box.h"

namespace tandem::build {
namespace {

// Says why the positions of a pose cannot be used; empty where they can.
std::string pose_defect(const std::vector<Point>& pose) {
  for (std::size_t v = 0; v < pose.size(); ++v) {
    for (const double x : pose[v]) {
      if (!std::isfinite(x))
        return "vertex " + std::to_string(v) + " has a coordinate that is NaN or infinite";
      if (std::abs(x) > double{kMaxCoordinate})
        return "vertex " + std::to_string(v) + " has a coordinate too large for float32";
    }
  }
  return {};
}

// Says how a pose differs from the mesh in more than the places of its vertices; empty where it does not.
std::string mesh_difference(const PolygonMesh& mesh, const PolygonMesh& pose, const std::string& name) {
  const auto counts = [&](std::size_t has, std::size_t wanted, const char* what) {
    return "has " + with_commas(has) + " " + what + ", and " + name + " has " + with_commas(wanted);
  };
  if (pose.points.size() != mesh.points.size())
    return counts(pose.points.size(), mesh.points.size(), "vertices");
  if (pose.face_count() != mesh.face_count()) return counts(pose.face_count(), mesh.face_count(), "faces");
  for (std::size_t face = 0; face < mesh.face_count(); ++face) {
    const std::uint32_t begin = mesh.face_begin[face], end = mesh.face_begin[face + 1];
    const bool same =
        pose.face_begin[face] == begin && pose.face_begin[face + 1] == end &&
        std::equal(mesh.corners.begin() + begin, mesh.corners.begin() + end, pose.corners.begin() + begin);
    if (!same) return "face " + with_commas(face) + " has other vertices than in " + name;
  }
  return {};
}

SampledImport& refuse(SampledImport& import, const std::filesystem::path& file, const std::string& reason) {
  import.read.ok = false;
  import.read.error = reason;
  import.refused = file;
  return import;
}

SampledImport import_animation(const Options& options) {
  SampledImport import;
  import.refused = options.input;
  if (options.import.reader == Reader::assimp)
    return refuse(import, options.input, "assimp reads no animations for Tandem");
  AnimatedMesh animated = import_animated(options.input, options.import);
  import.read = std::move(animated.read);
  if (!import.read.ok) return import;
  import.names = {"rest"};
  const std::vector<AnimationClip>& clips = animated.animation->clips();
  for (const AnimationTime& time : spread_times(clips, options.samples - 1)) {
    const AnimationClip& clip = clips[time.clip];
    import.names.push_back((clip.name.empty() ? format("animation %zu", time.clip) : clip.name) +
                           format(" at %.4g s", time.seconds));
    std::vector<Point>& pose = import.read.mesh.poses.emplace_back();
    animated.animation->at(time, pose);
    if (const std::string defect = pose_defect(pose); !defect.empty())
      return refuse(import, options.input, import.names.back() + ": " + defect);
  }
  return import;
}

SampledImport import_poses(const Options& options) {
  SampledImport import;
  import.refused = options.input;
  import.read = import_mesh(options.input, options.import);
  if (!import.read.ok || options.poses.empty()) return import;
  PolygonMesh& mesh = import.read.mesh;
  import.names = {"rest"};
  for (const std::string& name : options.poses) {
    const std::filesystem::path file = path_of(name);
    ImportResult pose = import_mesh(file, options.import);
    if (!pose.ok) return refuse(import, file, pose.error);
    std::string defect = mesh_difference(mesh, pose.mesh, text_of(options.input.filename()));
    if (defect.empty()) defect = pose_defect(pose.mesh.points);
    if (!defect.empty()) return refuse(import, file, defect);
    mesh.poses.push_back(std::move(pose.mesh.points));
    import.names.push_back(text_of(file.filename()));
    import.pose_files.push_back(file);
    import.read.files.insert(import.read.files.end(), pose.files.begin(), pose.files.end());
    import.read.files.push_back(name);
  }
  return import;
}

}  // namespace

SampledImport import_samples(const Options& options) {
  return options.animation ? import_animation(options) : import_poses(options);
}

}  // namespace tandem::build
