#pragma once
#include "tandem/kernels/scene.h"

namespace tandem {

/// Makes what answers a scene's questions on the current GPU, for Scene::answer_on(); null where there is no
/// memory for it.
SceneDevice* gpu_scene_device();

/// A scene whose questions a GPU answers: the functions, the questions and the rows in CPU memory are those
/// of Scene. Bodies and assets are copied to the GPU when they have changed, rows come back. Who has poses or
/// wants rows in GPU memory asks GpuContactQuery and the others, which take arrays there.
///
/// Contacts, manifolds, contained bodies and verdicts are those of the CPU, contacts by pair, face_a, face_b;
/// rays but any hit are too; distances, closest points and impacts are as certified, but not the same bytes.
/// DistanceOptions::former is not looked at. Manifolds and contained bodies are found on the GPU where they
/// are asked of a ContactQuery that the scene has answered, and by the CPU of contacts that are given as a
/// list. So are object pairs after few bodies have changed. set_threads() is about the CPU.
///
/// Each function may also return kNoGpu, kDriverTooOld, kGpuNotSupported, kOutOfGpuMemory or kCudaFailed.
/// Questions of contacts in mode exact, impacts and verdicts return kNoOrientedBlocks where an asset has
/// none, and where() is that asset.
class GpuScene : public Scene {
 public:
  /// The scene is on the current GPU, and waits for what is on its default stream. Where there is no memory
  /// for that, the CPU answers.
  GpuScene() { static_cast<void>(answer_on(gpu_scene_device())); }
};

}  // namespace tandem
