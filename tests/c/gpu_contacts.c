#include <cuda_runtime_api.h>
#include <stdio.h>
#include <tandem/tandem_cuda.h>

/* Two bodies half a length apart, whose poses lie in GPU memory: how many of their triangles meet. */
int main(int argc, char** argv) {
  const tandem_pose at[2] = {{{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}, {0.0, 0, 0}},
                             {{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}, {0.5, 0, 0}}};
  tandem_asset* asset = NULL;
  tandem_gpu_assets* on_gpu = NULL;
  tandem_gpu_broad_phase* near = NULL;
  tandem_gpu_contact_query* query = NULL;
  tandem_gpu_query_report report = {0};
  void *poses = NULL, *numbers = NULL;
  const tandem_stream stream = NULL; /* the default one; a cudaStream_t of yours else */
  tandem_status status = tandem_asset_open(argc > 1 ? argv[1] : "", NULL, NULL, &asset, NULL);
  if (status == TANDEM_OK) status = tandem_gpu_assets_upload(&asset, 1, NULL, stream, NULL, &on_gpu, NULL);
  if (status == TANDEM_OK) status = tandem_gpu_broad_phase_create(NULL, &near);
  if (status == TANDEM_OK) status = tandem_gpu_broad_phase_set_assets(near, on_gpu);
  if (status == TANDEM_OK) status = tandem_gpu_contact_query_create(NULL, &query);
  if (status == TANDEM_OK) status = tandem_gpu_contact_query_set_assets(query, on_gpu, stream);
  /* In a simulation these two arrays are there already. */
  if (status == TANDEM_OK && cudaMalloc(&poses, sizeof at) == cudaSuccess &&
      cudaMalloc(&numbers, 2 * sizeof(uint32_t)) == cudaSuccess) {
    const tandem_gpu_instances bodies = {(uint32_t*)numbers, (tandem_pose*)poses, 2, 0};
    cudaMemcpy(poses, at, sizeof at, cudaMemcpyHostToDevice);
    cudaMemset(numbers, 0, 2 * sizeof(uint32_t));
    status = tandem_gpu_broad_phase_find(near, &bodies, NULL, stream);
    const tandem_gpu_pairs pairs = tandem_gpu_broad_phase_pairs(near);
    if (status == TANDEM_OK) status = tandem_gpu_contact_query_find(query, &bodies, &pairs, NULL, stream);
    if (status == TANDEM_OK) status = tandem_gpu_contact_query_get_report(query, &report);
  }
  if (status == TANDEM_OK) {
    printf("%u pairs of triangles meet\n", (unsigned)report.contacts);
  } else {
    printf("%s\n", tandem_status_explain(status));
  }
  cudaFree(numbers);
  cudaFree(poses);
  tandem_gpu_contact_query_destroy(query);
  tandem_gpu_broad_phase_destroy(near);
  tandem_gpu_assets_release(on_gpu);
  tandem_asset_release(asset);
  return status != TANDEM_OK;
}
