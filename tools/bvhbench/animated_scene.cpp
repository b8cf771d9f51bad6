#include "animated_scene.h"

#include <algorithm>

namespace tandem::bench {
namespace {

constexpr std::size_t kSamplesBesideRest = 7;  // as bvhbuild --animation takes

// Faces of glTF files are triangles.
std::vector<build::TriangleIndices> triangles_of(const build::PolygonMesh& mesh) {
  std::vector<build::TriangleIndices> triangles(mesh.face_count());
  for (std::size_t f = 0; f < triangles.size(); ++f)
    std::copy_n(&mesh.corners[mesh.face_begin[f]], 3, triangles[f].begin());
  return triangles;
}

std::vector<float> rounded(const std::vector<build::Point>& points) {
  std::vector<float> numbers;
  numbers.reserve(3 * points.size());
  for (const build::Point& point : points) {
    for (const double x : point) numbers.push_back(static_cast<float>(x));
  }
  return numbers;
}

// A quarter of the longest side of the bounds of these points, along this side.
void set_beside(const std::vector<build::Point>& points, double (&translation)[3]) {
  std::size_t longest = 0;
  double sides[3];
  for (std::size_t k = 0; k < 3; ++k) {
    const auto [least, most] =
        std::minmax_element(points.begin(), points.end(),
                            [&](const build::Point& a, const build::Point& b) { return a[k] < b[k]; });
    sides[k] = (*most)[k] - (*least)[k];
    if (sides[k] > sides[longest]) longest = k;
  }
  translation[longest] = 0.25 * sides[longest];
}

}  // namespace

AnimatedScene::AnimatedScene(const std::string& path, const std::string& asset, std::uint32_t frames,
                             unsigned threads)
    : mesh_(build::import_animated(path, {})) {
  if (!mesh_.read.ok) throw FileError(path + ": " + mesh_.read.error);
  times_ = spread_times(mesh_.animation->clips(), frames);
  const AssetView view = asset_of(path, asset, threads);
  names_.description.assets = {asset.empty() ? path : asset};
  names_.shapes = {{0}};
  Instance body = {0, {{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}, {0, 0, 0}}};
  names_.description.instances = {body, body};
  set_beside(mesh_.read.mesh.points, names_.description.instances[1].pose.translation);
  scene_.path = path;
  scene_.shapes = {view};
  scene_.instances = names_.description.instances;
  scene_.bending = {0};
  scene_.frames = static_cast<std::uint32_t>(times_.size());
  scene_.positions = [this](std::uint32_t, std::uint32_t frame) {
    std::vector<build::Point> points;
    mesh_.animation->at(times_[frame], points);
    return rounded(points);
  };
}

AssetView AnimatedScene::asset_of(const std::string& path, const std::string& asset, unsigned threads) {
  if (asset.empty()) return built(path, threads);
  mapped_ = open_mesh(asset);
  const AssetView view = mapped_.view();
  if (view.header->source_vertices == 0) throw FileError(asset + ": " + explain(Status::kNoSourceVertices));
  if (view.header->source_vertices != mesh_.animation->vertex_count()) {
    throw FileError(asset + ": is of " + std::to_string(view.header->source_vertices) + " vertices, and " +
                    path + " moves " + std::to_string(mesh_.animation->vertex_count()));
  }
  return view.levels_from(0, 1);
}

AssetView AnimatedScene::built(const std::string& path, unsigned threads) {
  const std::vector<build::TriangleIndices> triangles = triangles_of(mesh_.read.mesh);
  std::vector<std::vector<build::Point>> poses;
  for (const build::AnimationTime& time : spread_times(mesh_.animation->clips(), kSamplesBesideRest))
    mesh_.animation->at(time, poses.emplace_back());
  build::TriangleSource source;
  source.points = mesh_.read.mesh.points;
  source.triangles = triangles;
  source.poses = poses;
  build::BuildOptions options;
  options.threads = threads;
  build::OptimisationWatch watch;
  built_ = std::move(build::build_asset(source, options, {}, watch).file);
  if (!built_) throw FileError(path + ": has no triangle that can be used");
  return built_->asset;
}

}  // namespace tandem::bench
