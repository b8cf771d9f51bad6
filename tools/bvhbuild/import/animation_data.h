#pragma once
#include <array>
#include <cstdint>
#include <vector>

#include "animation.h"
#include "gltf_model.h"

namespace tandem::build {

/// The parts of a node's transform and the weights of its mesh's morph targets, which animations change.
struct NodeState {
  GltfParts parts;
  std::vector<double> weights;
};

struct AnimatedNode {
  int parent = -1;
  Affine local = kIdentity;  ///< at rest
  NodeState rest;
};

/// The joints of a skin and the maps from the mesh at its binding to them.
struct AnimatedSkin {
  std::vector<std::uint32_t> joints;  ///< nodes
  std::vector<Affine> inverse_bind;   ///< of each joint
};

/// A joint's share of a vertex.
struct Influence {
  std::uint32_t joint = 0;  ///< of the skin
  double weight = 0;        ///< the weights of a vertex add up to 1
};

/// Source vertices that follow each other and move alike: those of one accessor at one node.
struct VertexRun {
  std::uint32_t node = 0;
  int skin = -1;  ///< -1: the vertices move with the node
  std::vector<Point> base;
  std::vector<std::vector<Point>> targets;     ///< differences from the base, for each morph target
  std::vector<std::uint32_t> influence_begin;  ///< of each vertex, and the end; empty without a skin
  /// Those of a vertex are sorted by joint, so that vertices with the same influences are moved to the same
  /// place to the last bit, in whatever order the file has them.
  std::vector<Influence> influences;
};

enum class AnimatedPath : std::uint8_t { translation, rotation, scale, weights };
enum class Interpolation : std::uint8_t { step, linear, cubic_spline };

/// The course of one property of a node.
struct AnimationChannel {
  std::uint32_t node = 0;
  AnimatedPath path = AnimatedPath::translation;
  Interpolation interpolation = Interpolation::linear;
  std::size_t width = 3;       ///< numbers of a value
  std::vector<double> times;   ///< ascending
  std::vector<double> values;  ///< for each time one; of cubic splines its in-tangent before and its
                               ///< out-tangent after it
};

struct AnimationData {
  std::vector<AnimatedNode> nodes;
  std::vector<std::uint32_t> order;  ///< the nodes of the scene, parents before their children
  std::vector<AnimatedSkin> skins;
  std::vector<VertexRun> runs;
  std::vector<AnimationClip> clips;
  std::vector<std::vector<AnimationChannel>> channels;  ///< of each clip
  std::size_t vertex_count = 0;
};

}  // namespace tandem::build
