// Finds the contacts of scenes on the GPU through the C interface and prints of each how many pairs and contacts there
// are, and their hash. C99.
// Usage: gpu_scene_hash MODE WITHIN SCENE...   Exit code 77: there is no GPU.
// TANDEM_REPEAT=N: then makes N calls of both kinds again and says how many microseconds the median of them took.
#define _POSIX_C_SOURCE 200112L
#include <time.h>

#include "gpu_c_test.h"
#include "scene_text.h"

static int compare_numbers(const void* x, const void* y) {
  const double a = *(const double*)x, b = *(const double*)y;
  return a < b ? -1 : a > b;
}

static double microseconds(void) {
  struct timespec now;
  clock_gettime(CLOCK_MONOTONIC, &now);
  return 1e6 * (double)now.tv_sec + 1e-3 * (double)now.tv_nsec;
}

static void print_scene(const char* file, uint32_t mode, double within) {
  Scene scene = read_scene(file);
  const cudaStream_t stream = NULL;
  tandem_gpu_assets* assets = NULL;
  tandem_gpu_broad_phase* broad_phase = NULL;
  tandem_gpu_contact_query* query = NULL;
  CHECK_STATUS(tandem_gpu_assets_upload(scene.assets, scene.asset_count, NULL, stream, NULL, &assets, NULL), TANDEM_OK);
  release_assets(&scene);
  CHECK_STATUS(tandem_gpu_broad_phase_create(NULL, &broad_phase), TANDEM_OK);
  CHECK_STATUS(tandem_gpu_broad_phase_set_assets(broad_phase, assets), TANDEM_OK);
  CHECK_STATUS(tandem_gpu_contact_query_create(NULL, &query), TANDEM_OK);
  CHECK_STATUS(tandem_gpu_contact_query_set_assets(query, assets, stream), TANDEM_OK);
  tandem_gpu_assets_release(assets);

  GpuScene on_gpu = scene_to_gpu(scene.instances, scene.count);
  uint8_t* motion = scene.motion != NULL ? (uint8_t*)to_gpu(scene.motion, scene.count) : NULL;
  tandem_gpu_pair_filter filter = {.struct_size = sizeof filter, .motion = motion};
  tandem_gpu_broad_phase_options near = {.struct_size = sizeof near, .sorted = 1, .within = within,
                                         .filter = &filter};
  tandem_gpu_query_options options = {.struct_size = sizeof options, .mode = mode, .within = near.within};
  tandem_gpu_pairs pairs = {0};
  tandem_object_pair* given = NULL;
  uint32_t pair_count = (uint32_t)scene.pair_count;
  if (scene.pairs != NULL) {
    pairs.pairs = given = (tandem_object_pair*)to_gpu(scene.pairs, scene.pair_count * sizeof *given);
    pairs.capacity = pair_count;
  } else {
    tandem_gpu_broad_phase_report report;
    CHECK_STATUS(tandem_gpu_broad_phase_find(broad_phase, &on_gpu.instances, &near, stream), TANDEM_OK);
    CHECK_STATUS(tandem_gpu_broad_phase_get_report(broad_phase, &report), TANDEM_OK);
    pairs = tandem_gpu_broad_phase_pairs(broad_phase);
    pair_count = report.count;
  }
  tandem_gpu_query_report report;
  CHECK_STATUS(tandem_gpu_contact_query_find(query, &on_gpu.instances, &pairs, &options, stream), TANDEM_OK);
  CHECK_STATUS(tandem_gpu_contact_query_get_report(query, &report), TANDEM_OK);
  CHECK(report.complete == 1);
  tandem_object_pair* of = (tandem_object_pair*)from_gpu(pairs.pairs, pair_count * sizeof *of);
  tandem_contact* contacts =
      (tandem_contact*)from_gpu(tandem_gpu_contact_query_contacts(query), report.contacts * sizeof *contacts);
  print_found(of, pair_count, contacts, report.contacts);
  free(of);
  free(contacts);
  const size_t repeat = getenv("TANDEM_REPEAT") != NULL ? (size_t)atoi(getenv("TANDEM_REPEAT")) : 0;
  double* taken = (double*)list(repeat, sizeof *taken);
  near.sorted = 0;
  for (size_t i = 0; i < repeat; ++i) {
    taken[i] = -microseconds();
    if (scene.pairs == NULL) {
      CHECK_STATUS(tandem_gpu_broad_phase_find(broad_phase, &on_gpu.instances, &near, stream), TANDEM_OK);
      pairs = tandem_gpu_broad_phase_pairs(broad_phase);
    }
    CHECK_STATUS(tandem_gpu_contact_query_find(query, &on_gpu.instances, &pairs, &options, stream), TANDEM_OK);
    taken[i] += microseconds();
  }
  qsort(taken, repeat, sizeof *taken, compare_numbers);
  if (repeat > 0) printf("%.2f us\n", taken[repeat / 2]);
  free(taken);
  tandem_gpu_contact_query_destroy(query);
  tandem_gpu_broad_phase_destroy(broad_phase);
  free_gpu_scene(&on_gpu);
  cuda_must(cudaFree(motion));
  cuda_must(cudaFree(given));
  free_scene(&scene);
}

int main(int argc, char** argv) {
  if (argc < 4) return printf("usage: gpu_scene_hash MODE WITHIN SCENE...\n"), 1;
  if (!has_gpu()) return printf("there is no GPU\n"), NO_GPU;
  for (int i = 3; i < argc; ++i) print_scene(argv[i], (uint32_t)atoi(argv[1]), atof(argv[2]));
  return failures != 0;
}
