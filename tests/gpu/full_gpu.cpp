// Runs a command while a GPU has next to no memory left.
// Usage: full_gpu MEGABYTES_LEFT COMMAND...   Exit code: the command's; 77 where there is no GPU.
#include <cuda_runtime_api.h>
#include <spawn.h>
#include <sys/wait.h>

#include <cstdlib>

extern char** environ;

int main(int argc, char** argv) {
  if (argc < 3) return 1;
  std::size_t free = 0, total = 0;
  if (cudaMemGetInfo(&free, &total) != cudaSuccess) return 77;
  const std::size_t left = static_cast<std::size_t>(std::atoi(argv[1])) << 20;
  void* memory = nullptr;
  for (std::size_t bytes = std::size_t{1} << 34; bytes >= std::size_t{1} << 20; bytes /= 2) {
    while (cudaMemGetInfo(&free, &total) == cudaSuccess && free >= left + bytes &&
           cudaMalloc(&memory, bytes) == cudaSuccess) {
    }
  }
  pid_t child = 0;
  int status = 0;
  if (posix_spawnp(&child, argv[2], nullptr, nullptr, argv + 2, environ) != 0) return 1;
  if (waitpid(child, &status, 0) != child || !WIFEXITED(status)) return 1;
  return WEXITSTATUS(status);
}
