#include <algorithm>
#include <cmath>
#include <exception>
#include <map>
#include <new>
#include <set>
#include <utility>

#include "animation_data.h"
#include "gltf_accessor.h"
#include "gltf_motion.h"
#include "gltf_scene.h"
#include "own_readers.h"
#include "readers.h"

namespace tandem::build {
namespace {

class MotionReader {
 public:
  MotionReader(const GltfModel& model, const GltfMotion& motion, const ReadLimits& limits)
      : model_(model), motion_(motion), numbers_left_(model.bytes_held + limits.expansion) {}

  AnimationData read() {
    if (motion_.animations.empty()) throw GltfError("it has no animation");
    add_nodes();
    for (std::size_t i = 0; i < motion_.skins.size(); ++i) add_skin(i);
    walk_scene(model_, [&](std::size_t node, const GltfPlace&) { add_runs(node); });
    for (std::size_t i = 0; i < motion_.animations.size(); ++i) add_clip(i);
    if (data_.clips.empty()) throw GltfError("its animations move none of its nodes");
    return std::move(data_);
  }

 private:
  void add_nodes() {
    data_.nodes.resize(model_.nodes.size());
    in_scene_.assign(model_.nodes.size(), false);
    walk_scene(model_, [&](std::size_t node, const GltfPlace&) {
      data_.order.push_back(static_cast<std::uint32_t>(node));
      in_scene_[node] = true;
    });
    for (std::size_t i = 0; i < model_.nodes.size(); ++i) {
      AnimatedNode& node = data_.nodes[i];
      node.local = model_.nodes[i].local;
      node.rest = {motion_.nodes[i].parts, weights_at_rest(i)};
      for (const int child : model_.nodes[i].children) {
        if (in_scene_[i]) data_.nodes[static_cast<std::size_t>(child)].parent = static_cast<int>(i);
      }
    }
  }

  // Condition: the node is a number below that of nodes.
  std::vector<double> weights_at_rest(std::size_t node) const {
    const int mesh = model_.nodes[node].mesh;
    const bool has_mesh = mesh >= 0 && static_cast<std::size_t>(mesh) < motion_.meshes.size();
    const std::vector<double>& own = motion_.nodes[node].weights;
    return !own.empty() || !has_mesh ? own : motion_.meshes[static_cast<std::size_t>(mesh)].weights;
  }

  std::uint32_t node_in_scene(int node, const std::string& user) const {
    named(model_.nodes, "nodes", node, user);
    if (!in_scene_[static_cast<std::size_t>(node)])
      throw GltfError(user + " names " + numbered("nodes", node) + ", which is not in the scene");
    return static_cast<std::uint32_t>(node);
  }

  // Takes numbers from those that a file of this size may have, before they take memory: an accessor can
  // promise zeros without holding a byte.
  std::vector<double> numbers(int accessor, int components, const char* purpose) {
    const GltfAccessor& about = named(model_.accessors, "accessors", accessor, purpose);
    const std::uint64_t most = numbers_left_ / static_cast<std::uint64_t>(components);
    if (about.count > most)
      throw GltfError("its animations take more numbers than its bytes and --expansion-limit allow");
    numbers_left_ -= about.count * static_cast<std::uint64_t>(components);
    return read_numbers(model_, accessor, components, purpose);
  }

  void add_skin(std::size_t index) {
    const GltfSkin& from = motion_.skins[index];
    const std::string name = numbered("skins", static_cast<std::int64_t>(index));
    AnimatedSkin& to = data_.skins.emplace_back();
    for (const int joint : from.joints) to.joints.push_back(node_in_scene(joint, name));
    if (to.joints.empty()) throw GltfError(name + " has no joints");
    to.inverse_bind.assign(to.joints.size(), kIdentity);
    if (from.inverse_bind == -1) return;
    const std::vector<double> all = numbers(from.inverse_bind, 16, "an inverse bind matrix");
    if (all.size() < 16 * to.joints.size())
      throw GltfError(name + " has " + std::to_string(all.size() / 16) + " matrices for " +
                      std::to_string(to.joints.size()) + " joints");
    for (std::size_t j = 0; j < to.joints.size(); ++j) {
      for (std::size_t row = 0; row < 3; ++row) {
        for (std::size_t column = 0; column < 4; ++column)
          to.inverse_bind[j][row][column] = all[16 * j + 4 * column + row];
      }
    }
  }

  // The runs of a node, in the order in which read_gltf() reads their vertices.
  void add_runs(std::size_t node) {
    if (model_.nodes[node].mesh == -1) return;
    const auto mesh = static_cast<std::size_t>(model_.nodes[node].mesh);
    std::set<int> known;
    std::size_t index = 0;
    each_primitive(model_.meshes[mesh], mesh, [&](const GltfPrimitive& primitive, const std::string&) {
      const GltfPrimitiveMotion& motion = motion_.meshes[mesh].primitives[index++];
      if (!has_triangles(primitive) || primitive.positions == -1) return;
      if (known.insert(primitive.positions).second) add_run(node, primitive.positions, motion);
    });
  }

  void add_run(std::size_t node, int positions, const GltfPrimitiveMotion& motion) {
    VertexRun run;
    run.node = static_cast<std::uint32_t>(node);
    run.base = points(positions);
    for (const int target : motion.targets) {
      run.targets.push_back(target == -1 ? std::vector<Point>(run.base.size()) : points(target));
      if (run.targets.back().size() != run.base.size())
        throw GltfError("a morph target moves " + std::to_string(run.targets.back().size()) +
                        " vertices of " + std::to_string(run.base.size()));
    }
    if (motion_.nodes[node].skin != -1 && !motion.joints.empty()) {
      run.skin = motion_.nodes[node].skin;
      add_influences(
          named(data_.skins, "skins", run.skin, numbered("nodes", static_cast<std::int64_t>(node))), motion,
          run);
    }
    data_.vertex_count += run.base.size();
    data_.runs.push_back(std::move(run));
  }

  std::vector<Point> points(int accessor) {
    const std::vector<double> all = numbers(accessor, 3, "POSITION");
    std::vector<Point> out(all.size() / 3);
    for (std::size_t i = 0; i < all.size(); ++i) out[i / 3][i % 3] = all[i];
    return out;
  }

  void add_influences(const AnimatedSkin& skin, const GltfPrimitiveMotion& motion, VertexRun& run) {
    std::vector<std::vector<double>> joints, weights;
    for (std::size_t set = 0; set < motion.joints.size(); ++set) {
      joints.push_back(numbers(motion.joints[set], 4, "a joint"));
      weights.push_back(numbers(motion.weights[set], 4, "a weight"));
      if (joints.back().size() != 4 * run.base.size() || weights.back().size() != 4 * run.base.size())
        throw GltfError("joints and weights are not as many as vertices");
    }
    run.influence_begin.push_back(0);
    for (std::size_t v = 0; v < run.base.size(); ++v) {
      const std::size_t first = run.influences.size();
      for (std::size_t set = 0; set < joints.size(); ++set) {
        for (std::size_t i = 4 * v; i < 4 * v + 4; ++i)
          add_influence(skin, joints[set][i], weights[set][i], run);
      }
      finish_influences(first, run);
      run.influence_begin.push_back(static_cast<std::uint32_t>(run.influences.size()));
    }
  }

  static void add_influence(const AnimatedSkin& skin, double joint, double weight, VertexRun& run) {
    if (weight == 0) return;
    if (!(weight > 0) || !std::isfinite(weight)) throw GltfError("a weight is negative or not finite");
    if (!(joint >= 0 && joint < static_cast<double>(skin.joints.size())))
      throw GltfError("a vertex names joint " + std::to_string(static_cast<std::int64_t>(joint)) + " of " +
                      std::to_string(skin.joints.size()));
    run.influences.push_back({static_cast<std::uint32_t>(joint), weight});
  }

  // Makes the weights of a vertex add up to 1, which roundings in the file keep them from. A vertex without a
  // weight follows the first joint, as in other programs.
  static void finish_influences(std::size_t first, VertexRun& run) {
    if (run.influences.size() == first) run.influences.push_back({0, 1});
    const auto begin = run.influences.begin() + static_cast<std::ptrdiff_t>(first);
    std::sort(begin, run.influences.end(), [](const Influence& a, const Influence& b) {
      return a.joint != b.joint ? a.joint < b.joint : a.weight < b.weight;
    });
    double sum = 0;
    for (auto influence = begin; influence != run.influences.end(); ++influence) sum += influence->weight;
    for (auto influence = begin; influence != run.influences.end(); ++influence) influence->weight /= sum;
  }

  void add_clip(std::size_t index) {
    const GltfAnimation& from = motion_.animations[index];
    std::vector<AnimationChannel> channels;
    AnimationClip clip{from.name, HUGE_VAL, -HUGE_VAL};
    for (const GltfChannel& channel : from.channels) {
      if (channel.node == -1) continue;  // an extension says what it moves
      const std::string name = numbered("animations", static_cast<std::int64_t>(index));
      const bool is_shown =
          in_scene_[&named(model_.nodes, "nodes", channel.node, name) - model_.nodes.data()];
      const GltfSampler& sampler = named(from.samplers, "samplers", channel.sampler, name);
      if (!is_shown || !add_channel(channel, sampler, name, channels)) continue;
      clip.begin = std::min(clip.begin, channels.back().times.front());
      clip.end = std::max(clip.end, channels.back().times.back());
    }
    if (channels.empty()) return;
    data_.clips.push_back(std::move(clip));
    data_.channels.push_back(std::move(channels));
  }

  // Returns whether the channel moves vertices.
  bool add_channel(const GltfChannel& from, const GltfSampler& sampler, const std::string& name,
                   std::vector<AnimationChannel>& channels) {
    static const std::map<std::string, AnimatedPath> kPaths = {{"translation", AnimatedPath::translation},
                                                               {"rotation", AnimatedPath::rotation},
                                                               {"scale", AnimatedPath::scale},
                                                               {"weights", AnimatedPath::weights}};
    static const std::map<std::string, Interpolation> kInterpolations = {
        {"", Interpolation::linear},
        {"LINEAR", Interpolation::linear},
        {"STEP", Interpolation::step},
        {"CUBICSPLINE", Interpolation::cubic_spline}};
    const auto path = kPaths.find(from.path);
    if (path == kPaths.end()) return false;
    const auto interpolation = kInterpolations.find(sampler.interpolation);
    if (interpolation == kInterpolations.end())
      throw GltfError(name + " has an interpolation that is none of glTF: " + sampler.interpolation);
    const auto node = static_cast<std::size_t>(from.node);
    if (path->second != AnimatedPath::weights && motion_.nodes[node].has_matrix)
      throw GltfError(name + " moves " + numbered("nodes", from.node) + ", which has a matrix");
    AnimationChannel to{
        static_cast<std::uint32_t>(from.node), path->second, interpolation->second, 3, {}, {}};
    to.times = numbers(sampler.input, 1, "a time");
    to.values = numbers(sampler.output,
                        to.path == AnimatedPath::weights    ? 1
                        : to.path == AnimatedPath::rotation ? 4
                                                            : 3,
                        "a value of an animation");
    to.width = to.path == AnimatedPath::weights    ? target_count(node)
               : to.path == AnimatedPath::rotation ? 4
                                                   : 3;
    if (to.width == 0) return false;
    check_keys(to, name);
    channels.push_back(std::move(to));
    return true;
  }

  // The morph targets of the mesh at a node.
  std::size_t target_count(std::size_t node) const {
    const int mesh = model_.nodes[node].mesh;
    if (mesh < 0 || static_cast<std::size_t>(mesh) >= motion_.meshes.size()) return 0;
    std::size_t most = 0;
    for (const GltfPrimitiveMotion& primitive : motion_.meshes[static_cast<std::size_t>(mesh)].primitives)
      most = std::max(most, primitive.targets.size());
    return most;
  }

  static void check_keys(const AnimationChannel& channel, const std::string& name) {
    const std::size_t parts = channel.interpolation == Interpolation::cubic_spline ? 3 : 1;
    if (channel.times.empty()) throw GltfError(name + " has a sampler without a time");
    if (channel.values.size() != parts * channel.width * channel.times.size())
      throw GltfError(name + " has " + std::to_string(channel.values.size()) + " numbers where " +
                      std::to_string(parts * channel.width * channel.times.size()) + " belong to its " +
                      std::to_string(channel.times.size()) + " times");
    for (std::size_t i = 0; i < channel.times.size(); ++i) {
      if (!std::isfinite(channel.times[i]) || (i > 0 && !(channel.times[i] > channel.times[i - 1])))
        throw GltfError(name + " has times that do not ascend");
    }
    for (std::size_t i = 0; i < channel.values.size(); ++i) {
      if (!std::isfinite(channel.values[i])) throw GltfError(name + " has a value that is not finite");
    }
    if (channel.path != AnimatedPath::rotation) return;
    for (std::size_t key = 0; key < channel.times.size(); ++key) {
      const double* q = channel.values.data() + (parts * key + (parts == 3)) * 4;
      if (q[0] == 0 && q[1] == 0 && q[2] == 0 && q[3] == 0)
        throw GltfError(name + " has a rotation that is zero, which is no rotation");
    }
  }

  const GltfModel& model_;
  const GltfMotion& motion_;
  std::uint64_t numbers_left_;
  AnimationData data_;
  std::vector<bool> in_scene_;  // of each node
};

AnimatedMesh read(const std::filesystem::path& path, const ImportOptions& options) {
  const auto failure = [](std::string reason) { return AnimatedMesh{read_failure(std::move(reason)), {}}; };
  InputFile file;
  std::string problem = file.open(path);
  if (!problem.empty()) return failure(problem);
  const MeshKind kind = kind_of(path, file.head());
  if (!kind.refusal.empty()) return failure(kind.refusal);
  if (!kind.is_gltf) return failure("is no glTF file, and Tandem reads animations of no other");
  problem = load(file, options.limits);
  if (!problem.empty()) return failure(problem);
  AnimatedMesh animated{read_gltf(file.bytes(), path.parent_path(), options.limits, true), {}};
  if (!animated.read.ok) return animated;
  try {
    const ParsedGltf parsed = parse_gltf(file.bytes(), path.parent_path(), options.limits);
    const GltfMotion motion = read_gltf_motion(GltfObject(parsed.json));
    animated.animation.emplace(
        std::make_shared<const AnimationData>(MotionReader(parsed.model, motion, options.limits).read()));
  } catch (const GltfError& error) {
    return failure(error.what());
  }
  PolygonMesh& mesh = animated.read.mesh;
  if (animated.animation->vertex_count() != mesh.points.size())
    throw std::logic_error("the animation has other vertices than the mesh");
  animated.animation->rest(mesh.points);
  return animated;
}

}  // namespace

AnimatedMesh import_animated(const std::filesystem::path& path, const ImportOptions& options) {
  try {
    return read(path, options);
  } catch (const std::bad_alloc&) {
    return {read_failure("not enough memory to read it"), {}};
  } catch (const std::exception& error) {
    return {read_failure(error.what()), {}};
  }
}

}  // namespace tandem::build
