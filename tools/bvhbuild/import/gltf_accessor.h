#pragma once
#include <cstdint>
#include <vector>

#include "gltf_model.h"

namespace tandem::build {

/// How glTF numbers the types of an accessor's components (glTF 2.0, section 3.6.2.2). It has no int; double
/// is no part of the standard, but its number is taken and its meaning plain.
enum ComponentType {
  kInt8 = 5120,
  kUint8 = 5121,
  kInt16 = 5122,
  kUint16 = 5123,
  kUint32 = 5125,
  kFloat32 = 5126,
  kFloat64 = 5130
};

/// Throws a GltfError unless an accessor can be read as what it is used for: its type fits, and all its
/// elements, those of its sparse part included, lie inside its buffer views, and these inside their buffers:
/// "accessors[3] ends at byte 700 of bufferViews[1], which has 648".
void check_positions(const GltfModel& model, int accessor);
void check_indices(const GltfModel& model, int accessor);

/// Effect: fills `points` with the elements of an accessor that check_positions() found good: floats, or
/// integers as KHR_mesh_quantization has them, whole or normalised. Throws a GltfError for sparse indices out
/// of range.
void read_positions(const GltfModel& model, int accessor, std::vector<Point>& points);

/// Effect: fills `indices` with the elements of an accessor that check_indices() found good. The largest
/// number of its type, which restarts a primitive where that is allowed and in glTF means nothing, becomes
/// kNoVertex. Throws a GltfError for sparse indices out of range.
void read_indices(const GltfModel& model, int accessor, std::vector<std::uint32_t>& indices);

/// Returns the numbers of an accessor, element after element: floats, or integers, whole or normalised.
/// Throws a GltfError for one that is not there, has another number of components or lies outside its
/// buffers. purpose: for messages, such as "a weight".
std::vector<double> read_numbers(const GltfModel& model, int accessor, int components, const char* purpose);

}  // namespace tandem::build
