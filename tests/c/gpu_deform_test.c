// Deforms assets on a GPU and compares what queries find with what the CPU finds of the same positions, and
// tests what wrong calls return. C99. Usage: gpu_deform_test ASSETS_FOLDER   Exit code 77: there is no GPU.
#include "gpu_bodies.h"

// Source vertices of the cow, waving; step 0: as they are in the file.
static Triangles waving_cow(const char* folder, int step) {
  Triangles cow = read_obj(folder, "cow_1500.obj");
  for (size_t i = 0; i < cow.vertex_count; ++i) {
    double* at = &cow.positions[3 * i];
    at[1] += 0.1 * step * sin(4 * at[0] + step);
  }
  return cow;
}

static float* to_float32(const Triangles* mesh) {
  float* numbers = (float*)malloc(3 * mesh->vertex_count * sizeof *numbers);
  for (size_t i = 0; i < 3 * mesh->vertex_count; ++i) numbers[i] = (float)mesh->positions[i];
  return numbers;
}

// Calls that are wrong, of assets of which the third deforms.
static void check_wrong_deforming(tandem_gpu_assets* of) {
  tandem_gpu_assets* wrong = NULL;
  const uint32_t unknown[] = {0, 3}, descending[] = {2, 1}, last = 2;
  uint64_t where = 7;
  CHECK_STATUS(tandem_gpu_assets_create_deforming(gpu_assets, unknown, 2, 0, stream, NULL, &wrong, &where),
               TANDEM_UNKNOWN_ASSET);
  CHECK(wrong == NULL && where == 1);
  CHECK_STATUS(tandem_gpu_assets_create_deforming(gpu_assets, descending, 2, 0, stream, NULL, &wrong, &where),
               TANDEM_BAD_OPTION);
  CHECK_STATUS(tandem_gpu_assets_create_deforming(of, &last, 1, 0, stream, NULL, &wrong, NULL),
               TANDEM_BAD_OPTION);
  CHECK_STATUS(tandem_gpu_assets_deform(gpu_assets, NULL, NULL, stream), TANDEM_ASSETS_MISSING);
  CHECK_STATUS(tandem_gpu_assets_deform(of, NULL, NULL, stream), TANDEM_NULL_ARGUMENT);
  CHECK_STATUS(tandem_gpu_assets_get_report(gpu_assets, NULL), TANDEM_ASSETS_MISSING);
  CHECK(tandem_gpu_assets_device_report(gpu_assets) == NULL);
  tandem_upload_options contents = {sizeof contents, TANDEM_CONTENTS_EXACT_QUERIES};
  tandem_gpu_assets* part = NULL;
  CHECK_STATUS(tandem_gpu_assets_upload(assets, 3, &contents, stream, NULL, &part, NULL), TANDEM_OK);
  CHECK_STATUS(tandem_gpu_assets_create_deforming(part, &last, 1, 0, stream, NULL, &wrong, &where),
               TANDEM_NO_SOURCE_VERTICES);
  CHECK(where == 0 && tandem_gpu_assets_deforming_count(part) == 0);
  tandem_gpu_assets_release(part);
  tandem_gpu_tolerance_query* verdicts = NULL;
  CHECK_STATUS(tandem_gpu_tolerance_query_create(NULL, &verdicts), TANDEM_OK);
  CHECK_STATUS(tandem_gpu_tolerance_query_set_assets(verdicts, of, stream), TANDEM_DEFORMED);
  tandem_gpu_tolerance_query_destroy(verdicts);
}

// Bodies of which the cow deforms, on the GPU and on the CPU.
static tandem_gpu_assets* deforming;
static Queries queries;
static GpuScene scene;
static tandem_scene* expected;
static size_t bytes;         // of the positions
static float* on_gpu;        // the positions
static const float** table;  // of them
static tandem_gpu_pairs pairs;
static const uint32_t third = 2;

static void begin_deforming(const char* folder) {
  tandem_instance bodies[kBodies];
  CHECK_STATUS(tandem_gpu_assets_create_deforming(gpu_assets, &third, 1, 0, stream, NULL, &deforming, NULL),
               TANDEM_OK);
  CHECK(tandem_gpu_assets_deforming_count(deforming) == 1 && tandem_gpu_assets_count(deforming) == 3);
  CHECK(tandem_gpu_assets_bytes(deforming) > 0);
  place(bodies, 0);
  scene = scene_to_gpu(bodies, kBodies);
  queries = queries_of(deforming);
  expected = cpu_scene(bodies);
  Triangles rest = waving_cow(folder, 0);
  float* numbers = to_float32(&rest);
  bytes = 3 * rest.vertex_count * sizeof(float);
  on_gpu = (float*)to_gpu(numbers, bytes);
  table = (const float**)to_gpu(&on_gpu, sizeof on_gpu);
  free(numbers);
  free_mesh(&rest);
}

// A step of shapes, pairs and contacts.
static cudaGraphExec_t captured_step(const tandem_gpu_query_options* grouped) {
  const tandem_gpu_broad_phase_options sorted = sorted_pairs();
  const tandem_gpu_broad_phase_capacity near_room = {kBodies, kBodies * kBodies};
  const tandem_gpu_query_capacity room = {kBodies * kBodies, 0, 1000000, 200000};
  cudaGraph_t graph = NULL;
  cudaGraphExec_t step = NULL;
  CHECK_STATUS(tandem_gpu_broad_phase_reserve(queries.near, &near_room, &sorted), TANDEM_OK);
  CHECK_STATUS(tandem_gpu_contact_query_reserve(queries.contacts, &room, grouped), TANDEM_OK);
  pairs = tandem_gpu_broad_phase_pairs(queries.near);
  cuda_must(cudaStreamBeginCapture(stream, cudaStreamCaptureModeThreadLocal));
  CHECK_STATUS(tandem_gpu_assets_enqueue_deform(deforming, table, NULL, stream), TANDEM_OK);
  CHECK_STATUS(tandem_gpu_broad_phase_enqueue(queries.near, &scene.instances, &sorted, stream), TANDEM_OK);
  CHECK_STATUS(tandem_gpu_contact_query_enqueue(queries.contacts, &scene.instances, &pairs, grouped, stream),
               TANDEM_OK);
  cuda_must(cudaStreamEndCapture(stream, &graph));
  cuda_must(cudaGraphInstantiate(&step, graph, 0));
  cuda_must(cudaGraphDestroy(graph));
  return step;
}

// Launches the step with the positions of a cow, of which one vertex is NaN where `is_bad`; the cow keeps its
// shape then. Returns how many contacts there are.
static size_t launch(cudaGraphExec_t step, const Triangles* cow, int is_bad) {
  float* now = to_float32(cow);
  tandem_gpu_deform_report report;
  size_t count = 0;
  if (is_bad) now[3 * 17 + 1] = NAN;
  cuda_must(cudaMemcpy(on_gpu, now, bytes, cudaMemcpyHostToDevice));
  if (!is_bad) CHECK_STATUS(tandem_scene_deform(expected, third, now, cow->vertex_count), TANDEM_OK);
  CHECK_STATUS(tandem_scene_find_contacts(expected, NULL), TANDEM_OK);
  cuda_must(cudaGraphLaunch(step, stream));
  cuda_must(cudaStreamSynchronize(stream));
  CHECK_STATUS(tandem_gpu_assets_get_report(deforming, &report), is_bad ? TANDEM_OUT_OF_RANGE : TANDEM_OK);
  CHECK(!is_bad || (report.body == 0 && report.where == 17));
  CHECK(same(tandem_gpu_assets_device_report(deforming), &report, sizeof report));
  CHECK(same_contacts(queries.contacts, expected));
  (void)tandem_scene_contacts(expected, &count);
  free(now);
  return count;
}

// The queries have references to the assets. A null pointer in the table leaves the asset as it is.
static void ask_after_release(const tandem_gpu_query_options* grouped) {
  CHECK_STATUS(tandem_gpu_assets_deform(deforming, table, NULL, stream), TANDEM_OUT_OF_RANGE);
  cuda_must(cudaMemset((void*)table, 0, sizeof on_gpu));
  CHECK_STATUS(tandem_gpu_assets_deform(deforming, table, NULL, stream), TANDEM_OK);
  tandem_gpu_assets_release(deforming);
  CHECK_STATUS(tandem_gpu_contact_query_find(queries.contacts, &scene.instances, &pairs, grouped, stream),
               TANDEM_OK);
  CHECK(same_contacts(queries.contacts, expected));
  CHECK_STATUS(
      tandem_gpu_manifolds_find(queries.manifolds, &scene.instances, &pairs, queries.contacts, NULL, stream),
      TANDEM_OK);
}

static void test_deforming(const char* folder) {
  size_t counts[kSteps + 1];
  const tandem_gpu_query_options grouped = grouped_contacts();
  begin_deforming(folder);
  check_wrong_deforming(deforming);
  cudaGraphExec_t step = captured_step(&grouped);
  for (int i = 0; i <= kSteps; ++i) {
    Triangles cow = waving_cow(folder, i < kSteps ? i : 0);
    counts[i] = launch(step, &cow, i == kSteps);
    free_mesh(&cow);
  }
  CHECK(counts[0] != counts[1] && counts[1] != counts[2] && counts[kSteps] == counts[kSteps - 1]);
  ask_after_release(&grouped);
  cuda_must(cudaGraphExecDestroy(step));
  cuda_must(cudaFree((void*)table));
  cuda_must(cudaFree(on_gpu));
  tandem_scene_destroy(expected);
  destroy(&queries);
  free_gpu_scene(&scene);
}

// Positions in float64 that are no float32 numbers.
static void test_float64(const char* folder) {
  tandem_gpu_assets *precise = NULL, *single = NULL;
  tandem_gpu_manifolds* refused = NULL;
  tandem_instance bodies[kBodies];
  const tandem_gpu_query_options grouped = grouped_contacts();
  const tandem_gpu_broad_phase_options sorted = sorted_pairs();
  CHECK_STATUS(tandem_gpu_assets_create_deforming(gpu_assets, &third, 1, 1, stream, NULL, &precise, NULL),
               TANDEM_OK);
  CHECK_STATUS(tandem_gpu_assets_create_deforming(gpu_assets, &third, 1, 0, stream, NULL, &single, NULL),
               TANDEM_OK);
  CHECK(tandem_gpu_assets_bytes(precise) > tandem_gpu_assets_bytes(single));
  place(bodies, 0);
  GpuScene there = scene_to_gpu(bodies, kBodies);
  tandem_scene* here = cpu_scene(bodies);
  Triangles cow = waving_cow(folder, 1);
  double* numbers = (double*)to_gpu(cow.positions, 3 * cow.vertex_count * sizeof(double));
  const double** places = (const double**)to_gpu(&numbers, sizeof numbers);
  CHECK_STATUS(tandem_gpu_assets_deform(single, NULL, places, stream), TANDEM_NOT_FLOAT32);
  CHECK_STATUS(tandem_gpu_assets_deform(precise, NULL, places, stream), TANDEM_OK);
  CHECK_STATUS(tandem_scene_deform_f64(here, third, cow.positions, cow.vertex_count), TANDEM_OK);
  CHECK_STATUS(tandem_scene_find_contacts(here, NULL), TANDEM_OK);
  CHECK_STATUS(tandem_gpu_broad_phase_create(NULL, &queries.near), TANDEM_OK);
  CHECK_STATUS(tandem_gpu_contact_query_create(NULL, &queries.contacts), TANDEM_OK);
  CHECK_STATUS(tandem_gpu_broad_phase_set_assets(queries.near, precise), TANDEM_OK);
  CHECK_STATUS(tandem_gpu_contact_query_set_assets(queries.contacts, precise, stream), TANDEM_OK);
  CHECK_STATUS(tandem_gpu_broad_phase_find(queries.near, &there.instances, &sorted, stream), TANDEM_OK);
  pairs = tandem_gpu_broad_phase_pairs(queries.near);
  CHECK_STATUS(tandem_gpu_contact_query_find(queries.contacts, &there.instances, &pairs, &grouped, stream),
               TANDEM_OK);
  CHECK(same_contacts(queries.contacts, here));
  CHECK_STATUS(tandem_gpu_manifolds_create(NULL, &refused), TANDEM_OK);
  CHECK_STATUS(tandem_gpu_manifolds_set_assets(refused, precise, stream), TANDEM_NOT_FLOAT32);
  tandem_gpu_manifolds_destroy(refused);
  tandem_gpu_contact_query_destroy(queries.contacts);
  tandem_gpu_broad_phase_destroy(queries.near);
  cuda_must(cudaFree((void*)places));
  cuda_must(cudaFree(numbers));
  tandem_scene_destroy(here);
  free_mesh(&cow);
  free_gpu_scene(&there);
  tandem_gpu_assets_release(single);
  tandem_gpu_assets_release(precise);
}

int main(int argc, char** argv) {
  if (argc != 2) return printf("usage: gpu_deform_test ASSETS_FOLDER\n"), 1;
  if (!has_gpu()) return printf("there is no GPU\n"), NO_GPU;
  begin(argv[1]);
  test_deforming(argv[1]);
  test_float64(argv[1]);
  end();
  return failures != 0;
}
