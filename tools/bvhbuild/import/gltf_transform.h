#pragma once
#include <string>
#include <vector>

#include "import/affine.h"

namespace tandem::build {

/// The transform of a glTF node as the file has it: a matrix, or its parts; empty what it leaves out.
struct GltfTransform {
  const std::vector<double>& matrix;       ///< 16 numbers, column by column
  const std::vector<double>& rotation;     ///< quaternion x y z w
  const std::vector<double>& scale;        ///< x y z
  const std::vector<double>& translation;  ///< x y z
};

/// Result: empty, or which part is no transform: "matrix has 3 numbers, not 16".
std::string check_transform(const GltfTransform& transform);

/// The map from a node to its parent, of a transform that check_transform() found good.
Affine local_transform(const GltfTransform& transform);

}  // namespace tandem::build
