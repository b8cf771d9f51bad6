#include "gltf_motion.h"

namespace tandem::build {
namespace {

GltfPrimitiveMotion primitive_motion(const GltfObject& from) {
  GltfPrimitiveMotion to;
  from.each("targets", [&to](const GltfObject& target) { to.targets.push_back(target.index("POSITION")); });
  from.with("attributes", [&to](const GltfObject& all) {
    for (int set = 0;; ++set) {
      const std::string joints = "JOINTS_" + std::to_string(set), weights = "WEIGHTS_" + std::to_string(set);
      if (!all.has(joints.c_str()) || !all.has(weights.c_str())) return;
      to.joints.push_back(all.index(joints.c_str()));
      to.weights.push_back(all.index(weights.c_str()));
    }
  });
  return to;
}

GltfMeshMotion mesh_motion(const GltfObject& from) {
  GltfMeshMotion to{{}, from.list<double>("weights")};
  from.each("primitives", [&to](const GltfObject& item) { to.primitives.push_back(primitive_motion(item)); });
  return to;
}

GltfAnimation animation(const GltfObject& from) {
  GltfAnimation to{from.text("name"), {}, {}};
  from.each("samplers", [&to](const GltfObject& item) {
    to.samplers.push_back({item.index("input"), item.index("output"), item.text("interpolation")});
  });
  from.each("channels", [&to](const GltfObject& item) {
    GltfChannel& channel = to.channels.emplace_back();
    channel.sampler = item.index("sampler");
    item.with("target", [&channel](const GltfObject& target) {
      channel.node = target.index("node");
      channel.path = target.text("path");
    });
  });
  return to;
}

}  // namespace

GltfMotion read_gltf_motion(const GltfObject& root) {
  GltfMotion motion;
  root.each("nodes", [&](const GltfObject& node) {
    motion.nodes.push_back(
        {parts_of(node), node.has("matrix"), node.index("skin"), node.list<double>("weights")});
  });
  root.each("meshes", [&](const GltfObject& item) { motion.meshes.push_back(mesh_motion(item)); });
  root.each("skins", [&](const GltfObject& skin) {
    motion.skins.push_back({skin.list<int>("joints"), skin.index("inverseBindMatrices")});
  });
  root.each("animations", [&](const GltfObject& item) { motion.animations.push_back(animation(item)); });
  return motion;
}

}  // namespace tandem::build
