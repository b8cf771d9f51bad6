/// The C programs with a GPU share this: its memory, and scenes in it. C99.
#ifndef TANDEM_TESTS_C_GPU_C_TEST_H
#define TANDEM_TESTS_C_GPU_C_TEST_H
#include <cuda_runtime_api.h>
#include <tandem/tandem_cuda.h>

#include "c_test.h"

#define NO_GPU 77  ///< exit code: skipped

static inline void cuda_must(cudaError_t error) {
  if (error == cudaSuccess) return;
  printf("CUDA: %s\n", cudaGetErrorString(error));
  exit(1);
}

static inline int has_gpu(void) {
  int count = 0;
  return cudaGetDeviceCount(&count) == cudaSuccess && count > 0;
}

static inline void* to_gpu(const void* from, size_t bytes) {
  void* memory = NULL;
  cuda_must(cudaMalloc(&memory, bytes + 1));
  cuda_must(cudaMemcpy(memory, from, bytes, cudaMemcpyHostToDevice));
  return memory;
}

static inline void* from_gpu(const void* from, size_t bytes) {
  void* memory = malloc(bytes + 1);
  if (memory == NULL) exit(1);
  cuda_must(cudaMemcpy(memory, from, bytes, cudaMemcpyDeviceToHost));
  return memory;
}

/// Instances in GPU memory, which the caller frees.
typedef struct GpuScene {
  uint32_t* asset;
  tandem_pose* pose;
  tandem_gpu_instances instances;
} GpuScene;

static inline void write_poses(GpuScene* scene, const tandem_instance* from, size_t count) {
  tandem_pose* poses = (tandem_pose*)malloc((count + 1) * sizeof *poses);
  for (size_t i = 0; i < count; ++i) poses[i] = from[i].pose;
  cuda_must(cudaMemcpy(scene->pose, poses, count * sizeof *poses, cudaMemcpyHostToDevice));
  free(poses);
}

static inline GpuScene scene_to_gpu(const tandem_instance* from, size_t count) {
  GpuScene scene;
  uint32_t* assets = (uint32_t*)malloc((count + 1) * sizeof *assets);
  void* poses = NULL;
  for (size_t i = 0; i < count; ++i) assets[i] = from[i].asset;
  cuda_must(cudaMalloc(&poses, (count + 1) * sizeof(tandem_pose)));
  scene.asset = (uint32_t*)to_gpu(assets, count * sizeof *assets);
  scene.pose = (tandem_pose*)poses;
  free(assets);
  write_poses(&scene, from, count);
  scene.instances.asset = scene.asset;
  scene.instances.pose = scene.pose;
  scene.instances.count = (uint32_t)count;
  scene.instances.reserved = 0;
  return scene;
}

static inline void free_gpu_scene(GpuScene* scene) {
  cuda_must(cudaFree(scene->asset));
  cuda_must(cudaFree(scene->pose));
}

#endif
