// Builds the triangles of an OBJ file in memory, with the provenance that another file has, and writes the
// bytes. C99. Usage: build_file FOLDER NAME.obj WITH_PROVENANCE.bvh OUT.bvh FAST NO_GPU_BLOCKS NO_TOPOLOGY
// NO_REFIT FREE
#include "c_test.h"

int main(int argc, char** argv) {
  if (argc != 10)
    return printf("usage: build_file FOLDER NAME FROM OUT FAST NO_GPU_BLOCKS NO_TOPOLOGY NO_REFIT FREE\n"), 1;
  tandem_asset *from = NULL, *made = NULL;
  CHECK_STATUS(tandem_asset_open(argv[3], NULL, NULL, &from, NULL), TANDEM_OK);
  if (from == NULL) return 1;
  size_t bytes = 0;
  const char* json = tandem_asset_provenance(from, &bytes);
  char* provenance = (char*)calloc(bytes + 1, 1);
  memcpy(provenance, json, bytes);

  tandem_build_options options = {.struct_size = sizeof options,
                                  .effort = atoi(argv[5]) ? TANDEM_EFFORT_FAST : TANDEM_EFFORT_DEFAULT,
                                  .no_gpu_blocks = (uint32_t)atoi(argv[6]),
                                  .no_topology = (uint32_t)atoi(argv[7]),
                                  .no_refit = (uint32_t)atoi(argv[8]),
                                  .imaginary_share = atoi(argv[9]),
                                  .provenance = provenance};
  Triangles triangles = read_obj(argv[1], argv[2]);
  tandem_mesh mesh = mesh_of(&triangles);
  // The parts that bvhbuild's reader found.
  tandem_asset_info info;
  info.struct_size = sizeof info;
  CHECK_STATUS(tandem_asset_get_info(from, &info), TANDEM_OK);
  tandem_mesh_part* parts = (tandem_mesh_part*)calloc(info.part_count + 1, sizeof *parts);
  char* names = (char*)calloc(info.part_count + 1, 256);
  for (uint32_t i = 0; i < info.part_count; ++i) {
    tandem_part part;
    part.struct_size = sizeof part;
    CHECK_STATUS(tandem_asset_get_part(from, i, &part), TANDEM_OK);
    if (part.name_bytes > 255) return printf("the name of part %u is too long\n", i), 1;
    memcpy(names + 256 * i, part.name, part.name_bytes);
    parts[i].name = names + 256 * i;
    parts[i].face_count = part.face_count;
  }
  mesh.parts = parts;
  mesh.part_count = info.part_count;
  CHECK_STATUS(tandem_asset_build(&mesh, &options, NULL, &made, NULL), TANDEM_OK);
  const void* data = tandem_asset_data(made, &bytes);
  FILE* file = fopen(argv[4], "wb");
  CHECK(file != NULL && data != NULL && fwrite(data, 1, bytes, file) == bytes && fclose(file) == 0);
  tandem_asset_release(from);
  tandem_asset_release(made);
  free(provenance);
  free(parts);
  free(names);
  free_mesh(&triangles);
  return failures != 0;
}
