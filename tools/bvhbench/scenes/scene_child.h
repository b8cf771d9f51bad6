#pragma once
#include <functional>
#include <string>

#include "scene_file.h"

namespace tandem::bench {

/// Lets `read` make a description of the scene file in a child process, under limits, so that what a damaged
/// file does to the HDF5 library becomes an error: libhdf5 1.10 reads past its memory where a global heap is
/// damaged. Must be called while the process has a single thread. Throws FileError: that of `read`, or one of
/// the child's end.
SceneDescription read_in_child(const std::string& path,
                               const std::function<SceneDescription(const std::string&)>& read);

}  // namespace tandem::bench
