// Does all that the C interface does on a GPU and compares it with what it does on the CPU, in scenes of
// bodies that fall into one another. C99. Usage: gpu_use_test ASSETS_FOLDER   Exit code 77: there is no GPU.
#include "gpu_bodies.h"

// Steps of a simulation: pairs, contacts, groups, manifolds with their former points, contained bodies.
static void test_steps(void) {
  tandem_instance bodies[kBodies];
  place(bodies, 0);
  GpuScene scene = scene_to_gpu(bodies, kBodies);
  Queries queries = make_queries();
  tandem_scene* expected = cpu_scene(bodies);
  const tandem_gpu_broad_phase_options sorted = sorted_pairs();
  const tandem_gpu_query_options grouped = grouped_contacts();
  for (int step = 0; step < kSteps; ++step) {
    size_t count = 0, point_count = 0, pair_count = 0;
    place(bodies, step);
    write_poses(&scene, bodies, kBodies);
    CHECK_STATUS(tandem_scene_place(expected, bodies, kBodies, NULL), TANDEM_OK);
    CHECK_STATUS(tandem_scene_find_contacts(expected, NULL), TANDEM_OK);
    CHECK_STATUS(tandem_gpu_broad_phase_find(queries.near, &scene.instances, &sorted, stream), TANDEM_OK);
    const tandem_gpu_pairs pairs = tandem_gpu_broad_phase_pairs(queries.near);
    const tandem_object_pair* expected_pairs = tandem_scene_pairs(expected, TANDEM_CONTACTS, &pair_count);
    tandem_gpu_broad_phase_report near;
    CHECK_STATUS(tandem_gpu_broad_phase_get_report(queries.near, &near), TANDEM_OK);
    CHECK(near.complete == 1 && near.count == pair_count && near.found == pair_count);
    CHECK(same(pairs.pairs, expected_pairs, pair_count * sizeof *expected_pairs));
    CHECK(same(tandem_gpu_broad_phase_device_report(queries.near), &near, sizeof near));

    CHECK_STATUS(tandem_gpu_contact_query_find(queries.contacts, &scene.instances, &pairs, &grouped, stream),
                 TANDEM_OK);
    CHECK(same_contacts(queries.contacts, expected));
    tandem_gpu_query_report report;
    CHECK_STATUS(tandem_gpu_contact_query_get_report(queries.contacts, &report), TANDEM_OK);
    CHECK(same(tandem_gpu_contact_query_device_report(queries.contacts), &report, sizeof report));
    CHECK(report.counters.object_pairs == pair_count && report.counters.contacts == report.contacts);
    const tandem_gpu_contact_groups groups = tandem_gpu_contact_query_groups(queries.contacts);
    tandem_gpu_group_counts* counts = (tandem_gpu_group_counts*)from_gpu(groups.counts, sizeof *counts);
    CHECK(counts->pairs == pair_count && counts->contacts == report.contacts &&
          counts->few + counts->many > 0);
    free(counts);

    CHECK_STATUS(tandem_scene_find_manifolds(expected, NULL), TANDEM_OK);
    CHECK_STATUS(tandem_gpu_manifolds_find(queries.manifolds, &scene.instances, &pairs, queries.contacts,
                                           NULL, stream),
                 TANDEM_OK);
    tandem_gpu_manifold_report made;
    CHECK_STATUS(tandem_gpu_manifolds_get_report(queries.manifolds, &made), TANDEM_OK);
    const tandem_manifold* manifolds = tandem_scene_manifolds(expected, &count);
    const tandem_manifold_point* points = tandem_scene_points(expected, &point_count);
    CHECK(made.complete == 1 && made.manifolds == count && made.points == point_count && count > 0);
    CHECK(same(tandem_gpu_manifolds_manifolds(queries.manifolds), manifolds, count * sizeof *manifolds));
    CHECK(same(tandem_gpu_manifolds_points(queries.manifolds), points, point_count * sizeof *points));
    size_t followed = 0;
    for (size_t i = 0; i < point_count; ++i) followed += points[i].previous != TANDEM_NO_INDEX;
    CHECK((followed > 0) == (step > 0));

    CHECK_STATUS(tandem_scene_find_contained(expected), TANDEM_OK);
    CHECK_STATUS(tandem_gpu_containment_query_find(queries.contained, &scene.instances, &pairs,
                                                   queries.contacts, stream),
                 TANDEM_OK);
    tandem_gpu_containment_report inside;
    CHECK_STATUS(tandem_gpu_containment_query_get_report(queries.contained, &inside), TANDEM_OK);
    const tandem_containment* contained = tandem_scene_contained(expected, &count);
    CHECK(inside.complete == 1 && inside.contained == count && count > 0);
    CHECK(same(tandem_gpu_containment_query_contained(queries.contained), contained,
               count * sizeof *contained));
  }
  CHECK(tandem_gpu_contact_query_bytes(queries.contacts) > 0 &&
        tandem_gpu_manifolds_bytes(queries.manifolds) > 0);
  tandem_scene_destroy(expected);
  destroy(&queries);
  free_gpu_scene(&scene);
}

// Modes, clearance, the first contacts, sorted contacts.
static void test_options(void) {
  tandem_instance bodies[kBodies];
  place(bodies, 0);
  GpuScene scene = scene_to_gpu(bodies, kBodies);
  Queries queries = make_queries();
  tandem_scene* expected = cpu_scene(bodies);
  for (int variant = 0; variant < 4; ++variant) {
    tandem_contact_options cpu = {.struct_size = sizeof cpu,
                                  .mode = variant == 1   ? TANDEM_FAST
                                          : variant == 2 ? TANDEM_BOXES
                                                         : TANDEM_EXACT,
                                  .within = variant == 3 ? 0.05 : 0};
    tandem_gpu_broad_phase_options near = sorted_pairs();
    near.within = cpu.within;
    tandem_gpu_query_options options = grouped_contacts();
    options.grouped = 0;
    options.sorted = variant % 2;
    options.mode = cpu.mode;
    options.within = cpu.within;
    CHECK_STATUS(tandem_scene_find_contacts(expected, &cpu), TANDEM_OK);
    CHECK_STATUS(tandem_gpu_broad_phase_find(queries.near, &scene.instances, &near, stream), TANDEM_OK);
    const tandem_gpu_pairs pairs = tandem_gpu_broad_phase_pairs(queries.near);
    CHECK_STATUS(tandem_gpu_contact_query_find(queries.contacts, &scene.instances, &pairs, &options, stream),
                 TANDEM_OK);
    CHECK(same_contacts(queries.contacts, expected));
    if (options.sorted) {
      size_t count = 0;
      (void)tandem_scene_contacts(expected, &count);
      tandem_contact* found = (tandem_contact*)from_gpu(tandem_gpu_contact_query_contacts(queries.contacts),
                                                        count * sizeof *found);
      for (size_t i = 1; i < count; ++i) CHECK(compare_contacts(&found[i - 1], &found[i]) < 0);
      free(found);
    }
    // Nothing follows from contacts that are not grouped.
    CHECK_STATUS(tandem_gpu_manifolds_find(queries.manifolds, &scene.instances, &pairs, queries.contacts,
                                           NULL, stream),
                 TANDEM_CONTACTS_MISSING);
  }
  tandem_scene_destroy(expected);
  destroy(&queries);
  free_gpu_scene(&scene);
}

// Filters, kept bodies, excluded pairs.
static void test_filters(void) {
  tandem_instance bodies[kBodies];
  uint8_t motion[kBodies];
  uint32_t group[kBodies], mask[kBodies];
  place(bodies, 0);
  for (int i = 0; i < kBodies; ++i) {
    motion[i] = i % 3 == 0 ? TANDEM_FIXED : TANDEM_MOVING;
    group[i] = 1u << i % 4;
    mask[i] = i % 5 == 0 ? 7 : 15;
  }
  GpuScene scene = scene_to_gpu(bodies, kBodies);
  Queries queries = make_queries();
  tandem_scene* expected = cpu_scene(bodies);
  size_t count = 0;
  CHECK_STATUS(tandem_scene_find_pairs(expected, NULL), TANDEM_OK);
  const tandem_object_pair* all = tandem_scene_pairs(expected, TANDEM_PAIRS, &count);
  CHECK(count > 20);
  tandem_excluded_pairs* cpu_excluded = NULL;
  tandem_gpu_excluded_pairs* excluded = NULL;
  CHECK_STATUS(tandem_excluded_pairs_create(all, 20, NULL, &cpu_excluded), TANDEM_OK);
  CHECK_STATUS(tandem_gpu_excluded_pairs_create(all, 20, stream, NULL, &excluded), TANDEM_OK);
  tandem_pair_filter cpu_filter = {sizeof cpu_filter, 0, kBodies, motion, group, mask, NULL, cpu_excluded};
  uint8_t* gpu_motion = (uint8_t*)to_gpu(motion, sizeof motion);
  uint32_t *gpu_group = (uint32_t*)to_gpu(group, sizeof group),
           *gpu_mask = (uint32_t*)to_gpu(mask, sizeof mask);
  tandem_gpu_pair_filter filter = {sizeof filter, 0, gpu_motion, gpu_group, gpu_mask, NULL, excluded};
  tandem_gpu_broad_phase_options near = sorted_pairs();
  near.filter = &filter;
  CHECK_STATUS(tandem_scene_place(expected, bodies, kBodies, &cpu_filter), TANDEM_OK);
  CHECK_STATUS(tandem_scene_find_pairs(expected, NULL), TANDEM_OK);
  const tandem_object_pair* pairs = tandem_scene_pairs(expected, TANDEM_PAIRS, &count);
  for (int kept = 0; kept < 2; ++kept) {
    if (kept)
      CHECK_STATUS(tandem_gpu_broad_phase_keep_fixed(queries.near, &scene.instances, motion, NULL, stream),
                   TANDEM_OK);
    CHECK_STATUS(tandem_gpu_broad_phase_find(queries.near, &scene.instances, &near, stream), TANDEM_OK);
    tandem_gpu_broad_phase_report report;
    CHECK_STATUS(tandem_gpu_broad_phase_get_report(queries.near, &report), TANDEM_OK);
    CHECK(report.count == count && count > 0);
    CHECK(same(tandem_gpu_broad_phase_pairs(queries.near).pairs, pairs, count * sizeof *pairs));
  }
  tandem_gpu_excluded_pairs_destroy(excluded);
  tandem_excluded_pairs_destroy(cpu_excluded);
  tandem_scene_destroy(expected);
  destroy(&queries);
  cuda_must(cudaFree(gpu_motion));
  cuda_must(cudaFree(gpu_group));
  cuda_must(cudaFree(gpu_mask));
  free_gpu_scene(&scene);
}

// A step that was captured once finds the contacts of poses that are written later. Pairs are the caller's,
// and their number is in CPU memory.
static void test_a_graph(void) {
  tandem_instance bodies[kBodies];
  tandem_object_pair all[kBodies * (kBodies - 1) / 2];
  uint32_t pair_count = 0;
  for (uint32_t a = 0; a < kBodies; ++a)
    for (uint32_t b = a + 1; b < kBodies; ++b, ++pair_count) {
      all[pair_count].a = a;
      all[pair_count].b = b;
    }
  place(bodies, 0);
  GpuScene scene = scene_to_gpu(bodies, kBodies);
  Queries queries = make_queries();
  tandem_scene* expected = cpu_scene(bodies);
  const tandem_gpu_pairs pairs = {(tandem_object_pair*)to_gpu(all, sizeof all), NULL, pair_count, 0};
  const tandem_gpu_query_options grouped = grouped_contacts();
  const tandem_contact_options of_all = {sizeof of_all, TANDEM_EXACT, 0, 0, 0, 0, 0, all, pair_count};
  const tandem_gpu_query_capacity room = {pair_count, 0, 200000, 20000};
  cudaGraph_t graph = NULL;
  cudaGraphExec_t replay = NULL;
  CHECK_STATUS(tandem_gpu_contact_query_reserve(queries.contacts, &room, &grouped), TANDEM_OK);
  cuda_must(cudaStreamBeginCapture(stream, cudaStreamCaptureModeThreadLocal));
  CHECK_STATUS(tandem_gpu_contact_query_enqueue(queries.contacts, &scene.instances, &pairs, &grouped, stream),
               TANDEM_OK);
  cuda_must(cudaStreamEndCapture(stream, &graph));
  cuda_must(cudaGraphInstantiate(&replay, graph, 0));
  for (int step = 0; step < kSteps; ++step) {
    place(bodies, step);
    write_poses(&scene, bodies, kBodies);
    CHECK_STATUS(tandem_scene_place(expected, bodies, kBodies, NULL), TANDEM_OK);
    CHECK_STATUS(tandem_scene_find_contacts(expected, &of_all), TANDEM_OK);
    cuda_must(cudaGraphLaunch(replay, stream));
    cuda_must(cudaStreamSynchronize(stream));
    CHECK(same_contacts(queries.contacts, expected));
  }
  cuda_must(cudaGraphExecDestroy(replay));
  cuda_must(cudaGraphDestroy(graph));
  cuda_must(cudaFree((void*)pairs.pairs));
  tandem_scene_destroy(expected);
  destroy(&queries);
  free_gpu_scene(&scene);
}

// Probes, on the CPU and on the GPU, and what is asked about them on both.
enum { kProbes = 500 };
typedef struct Probes {
  double origins[kProbes][3], directions[kProbes][3];
  double *gpu_origins, *gpu_directions;
  GpuScene scene;
  tandem_scene* expected;
  tandem_gpu_probe_query* query;
} Probes;

static void make_probes(Probes* probes) {
  tandem_instance bodies[kBodies];
  place(bodies, 0);
  for (int i = 0; i < kProbes; ++i) {
    for (int k = 0; k < 3; ++k) {
      probes->origins[i][k] = 4 * random_number() - 1;
      probes->directions[i][k] = 2 * random_number() - 1;
    }
  }
  probes->scene = scene_to_gpu(bodies, kBodies);
  probes->expected = cpu_scene(bodies);
  probes->gpu_origins = (double*)to_gpu(probes->origins, sizeof probes->origins);
  probes->gpu_directions = (double*)to_gpu(probes->directions, sizeof probes->directions);
  CHECK_STATUS(tandem_gpu_probe_query_create(NULL, &probes->query), TANDEM_OK);
  CHECK_STATUS(tandem_gpu_probe_query_set_assets(probes->query, gpu_assets, stream), TANDEM_OK);
}

// Closest points are as certified as the CPU's, with the same sides.
static void test_points(const Probes* probes) {
  const tandem_closest_options options = {
      .struct_size = sizeof options, .sides = 1, .points = &probes->origins[0][0], .point_count = kProbes};
  const tandem_gpu_closest_options on_gpu = {
      .struct_size = sizeof on_gpu, .points = probes->gpu_origins, .point_count = kProbes, .sides = 1};
  tandem_gpu_probe_report report;
  size_t count = 0;
  CHECK_STATUS(tandem_scene_find_closest(probes->expected, &options), TANDEM_OK);
  const tandem_closest_point* points = tandem_scene_closest(probes->expected, &count);
  CHECK_STATUS(tandem_gpu_probe_query_find_closest(probes->query, &probes->scene.instances, &on_gpu, stream),
               TANDEM_OK);
  CHECK_STATUS(tandem_gpu_probe_query_get_report(probes->query, &report), TANDEM_OK);
  CHECK(report.rows == count && count == kProbes && report.counters.probes == kProbes);
  tandem_closest_point* ours =
      (tandem_closest_point*)from_gpu(tandem_gpu_probe_query_closest(probes->query), count * sizeof *ours);
  for (size_t i = 0; i < count; ++i) {
    CHECK(ours[i].lower <= points[i].upper && points[i].lower <= ours[i].upper);
    CHECK(ours[i].within == points[i].within && ours[i].winding == points[i].winding);
  }
  free(ours);
}

// The hits of rays are the CPU's, byte for byte.
static void test_rays(const Probes* probes) {
  const tandem_ray_options options = {.struct_size = sizeof options,
                                      .hits = TANDEM_ALL_HITS,
                                      .origins = &probes->origins[0][0],
                                      .directions = &probes->directions[0][0],
                                      .ray_count = kProbes};
  const tandem_gpu_ray_options on_gpu = {.struct_size = sizeof on_gpu,
                                         .hits = TANDEM_ALL_HITS,
                                         .ray_count = kProbes,
                                         .origins = probes->gpu_origins,
                                         .directions = probes->gpu_directions};
  const tandem_gpu_probe_capacity room = {kBodies, kProbes, 0, 0};
  const tandem_gpu_instances* const bodies = &probes->scene.instances;
  tandem_gpu_probe_report report;
  size_t count = 0;
  CHECK_STATUS(tandem_scene_find_rays(probes->expected, &options), TANDEM_OK);
  const tandem_ray_hit* hits = tandem_scene_rays(probes->expected, &count);
  CHECK_STATUS(tandem_gpu_probe_query_reserve(probes->query, &room), TANDEM_OK);
  CHECK_STATUS(tandem_gpu_probe_query_enqueue_rays(probes->query, bodies, &on_gpu, stream),
               TANDEM_OUT_OF_RANGE);
  CHECK_STATUS(tandem_gpu_probe_query_find_rays(probes->query, bodies, &on_gpu, stream), TANDEM_OK);
  CHECK_STATUS(tandem_gpu_probe_query_get_report(probes->query, &report), TANDEM_OK);
  CHECK(report.rows == count && count > 0 && report.counters.hits == count);
  tandem_ray_hit* ours =
      (tandem_ray_hit*)from_gpu(tandem_gpu_probe_query_rays(probes->query), count * sizeof *ours);
  CHECK(memcmp(ours, hits, count * sizeof *ours) == 0);
  free(ours);
}

static void test_points_and_rays(void) {
  static Probes probes;
  make_probes(&probes);
  test_points(&probes);
  test_rays(&probes);
  tandem_gpu_probe_query_destroy(probes.query);
  cuda_must(cudaFree(probes.gpu_origins));
  cuda_must(cudaFree(probes.gpu_directions));
  free_gpu_scene(&probes.scene);
  tandem_scene_destroy(probes.expected);
}

// Distances, times of impact and verdicts: as certified as the CPU's, or the same.
static void test_distances_and_impacts(void) {
  tandem_instance bodies[kBodies];
  tandem_motion motion[kBodies];
  place(bodies, 0);
  memset(motion, 0, sizeof motion);
  for (int i = 0; i < kBodies; ++i)
    for (int k = 0; k < 3; ++k) {
      motion[i].velocity[k] = 4 * random_number() - 2;
      motion[i].angular_velocity[k] = 2 * random_number() - 1;
      motion[i].centre[k] = bodies[i].pose.translation[k];
    }
  GpuScene scene = scene_to_gpu(bodies, kBodies);
  tandem_scene* expected = cpu_scene(bodies);
  tandem_gpu_distance_query* query = NULL;
  size_t count = 0, pair_count = 0;
  tandem_distance_options reach = {.struct_size = sizeof reach, .limit_reach = 1, .reach = 1};
  CHECK_STATUS(tandem_scene_find_distances(expected, &reach), TANDEM_OK);
  const tandem_distance* distances = tandem_scene_distances(expected, &count);
  const tandem_object_pair* pairs = tandem_scene_pairs(expected, TANDEM_DISTANCES, &pair_count);
  const tandem_gpu_pairs given = {(tandem_object_pair*)to_gpu(pairs, pair_count * sizeof *pairs), NULL,
                                  (uint32_t)pair_count, 0};
  CHECK_STATUS(tandem_gpu_distance_query_create(NULL, &query), TANDEM_OK);
  CHECK_STATUS(tandem_gpu_distance_query_set_assets(query, gpu_assets, stream), TANDEM_OK);
  for (int again = 0; again < 2; ++again) {
    size_t touching = 0, apart = 0;
    tandem_gpu_distance_options options = {
        .struct_size = sizeof options, .former = again ? tandem_gpu_distance_query_distances(query) : NULL};
    CHECK_STATUS(tandem_gpu_distance_query_find(query, &scene.instances, &given, &options, stream),
                 TANDEM_OK);
    tandem_gpu_distance_report report;
    CHECK_STATUS(tandem_gpu_distance_query_get_report(query, &report), TANDEM_OK);
    CHECK(report.complete == 1 && report.counters.object_pairs == pair_count && count == pair_count);
    tandem_distance* found =
        (tandem_distance*)from_gpu(tandem_gpu_distance_query_distances(query), count * sizeof *found);
    for (size_t i = 0; i < count; ++i) {
      const tandem_distance *ours = &found[i], *theirs = &distances[i];
      CHECK((ours->upper == 0) == (theirs->upper == 0));
      CHECK(ours->lower <= ours->upper && ours->upper - ours->lower <= 1e-6 * ours->upper);
      if (theirs->triangle_a == TANDEM_NO_INDEX) {
        CHECK(ours->upper >= theirs->lower);
      } else {
        CHECK(ours->lower <= theirs->upper && theirs->lower <= ours->upper);
      }
      touching += ours->upper == 0;
      apart += ours->upper != 0;
    }
    CHECK(touching > 0 && apart > 0);
    free(found);
  }
  tandem_gpu_distance_query_destroy(query);

  tandem_gpu_impact_query* impact_query = NULL;
  tandem_motion* gpu_motion = (tandem_motion*)to_gpu(motion, sizeof motion);
  const tandem_impact_options moving = {sizeof moving, 0, 0.1, 0, motion, kBodies, NULL, 0};
  CHECK_STATUS(tandem_scene_find_impacts(expected, &moving), TANDEM_OK);
  const tandem_impact* impacts = tandem_scene_impacts(expected, &count);
  const tandem_object_pair* swept = tandem_scene_pairs(expected, TANDEM_IMPACTS, NULL);
  tandem_gpu_impact_options sorted = {.struct_size = sizeof sorted, .sorted = 1};
  CHECK_STATUS(tandem_gpu_impact_query_create(NULL, &impact_query), TANDEM_OK);
  CHECK_STATUS(tandem_gpu_impact_query_set_assets(impact_query, gpu_assets, stream), TANDEM_OK);
  CHECK_STATUS(
      tandem_gpu_impact_query_find(impact_query, &scene.instances, gpu_motion, 0.1, NULL, &sorted, stream),
      TANDEM_OK);
  tandem_gpu_impact_report impact_report;
  CHECK_STATUS(tandem_gpu_impact_query_get_report(impact_query, &impact_report), TANDEM_OK);
  CHECK(impact_report.complete == 1 && impact_report.impacts == count && count > 0);
  CHECK(same(tandem_gpu_impact_query_pairs(impact_query).pairs, swept, count * sizeof *swept));
  tandem_impact* found_impacts =
      (tandem_impact*)from_gpu(tandem_gpu_impact_query_impacts(impact_query), count * sizeof *found_impacts);
  size_t met = 0;
  for (size_t i = 0; i < count; ++i) {
    // Both stop within the tolerance of the impact, which speeds of a few lengths a second pass in no time.
    CHECK(fabs(found_impacts[i].t_safe - impacts[i].t_safe) < 1e-3);
    CHECK((found_impacts[i].status == TANDEM_IMPACT_AT_START) ==
          (impacts[i].status == TANDEM_IMPACT_AT_START));
    met += impacts[i].status == TANDEM_IMPACT;
  }
  CHECK(met > 0);
  free(found_impacts);
  CHECK_STATUS(
      tandem_gpu_impact_query_find(impact_query, &scene.instances, gpu_motion, -1, NULL, &sorted, stream),
      TANDEM_BAD_DURATION);
  CHECK_STATUS(tandem_gpu_impact_query_find(impact_query, &scene.instances, NULL, 1, NULL, &sorted, stream),
               TANDEM_NULL_ARGUMENT);
  tandem_gpu_impact_query_destroy(impact_query);
  cuda_must(cudaFree(gpu_motion));

  tandem_gpu_tolerance_query* tolerance_query = NULL;
  const tandem_tolerance_options tolerance = {sizeof tolerance, 0, 0.01, pairs, pair_count};
  CHECK_STATUS(tandem_scene_find_verdicts(expected, &tolerance), TANDEM_OK);
  const tandem_verdict* verdicts = tandem_scene_verdicts(expected, &count);
  CHECK_STATUS(tandem_gpu_tolerance_query_create(NULL, &tolerance_query), TANDEM_OK);
  CHECK_STATUS(tandem_gpu_tolerance_query_set_assets(tolerance_query, gpu_assets, stream), TANDEM_OK);
  CHECK_STATUS(tandem_gpu_tolerance_query_find(tolerance_query, &scene.instances, &given, 0.01, stream),
               TANDEM_OK);
  tandem_gpu_tolerance_report decided;
  CHECK_STATUS(tandem_gpu_tolerance_query_get_report(tolerance_query, &decided), TANDEM_OK);
  const tandem_tolerance_counters of = decided.counters;
  CHECK(decided.complete == 1 && of.apart + of.touching + of.within_tolerance == count);
  CHECK(count == pair_count && of.touching > 0 && of.apart > 0);
  CHECK(same(tandem_gpu_tolerance_query_verdicts(tolerance_query), verdicts, count * sizeof *verdicts));
  tandem_gpu_tolerance_query_destroy(tolerance_query);
  tandem_scene_destroy(expected);
  cuda_must(cudaFree((void*)given.pairs));
  free_gpu_scene(&scene);
}

// What is wrong has its name, and the instance to blame; nothing is lost where there is too little room.
static void test_errors(void) {
  tandem_instance bodies[kBodies];
  place(bodies, 0);
  bodies[17].pose.rotation[1][1] += 0.1;
  GpuScene scene = scene_to_gpu(bodies, kBodies);
  Queries queries = make_queries();
  tandem_gpu_broad_phase_report near;
  tandem_gpu_query_report report;
  CHECK_STATUS(tandem_gpu_broad_phase_find(queries.near, &scene.instances, NULL, stream),
               TANDEM_POSE_NOT_RIGID);
  CHECK_STATUS(tandem_gpu_broad_phase_get_report(queries.near, &near), TANDEM_POSE_NOT_RIGID);
  CHECK(near.where == 17 && near.status != TANDEM_OK && near.count == 0);
  place(bodies, 0);
  write_poses(&scene, bodies, kBodies);
  tandem_object_pair unknown[2] = {{0, 1}, {2, kBodies}};
  tandem_gpu_pairs pairs = {(tandem_object_pair*)to_gpu(unknown, sizeof unknown), NULL, 2, 0};
  CHECK_STATUS(tandem_gpu_contact_query_find(queries.contacts, &scene.instances, &pairs, NULL, stream),
               TANDEM_UNKNOWN_INSTANCE);
  CHECK_STATUS(tandem_gpu_contact_query_get_report(queries.contacts, &report), TANDEM_UNKNOWN_INSTANCE);
  CHECK(report.where == 1 && report.contacts == 0);
  cuda_must(cudaFree((void*)pairs.pairs));

  CHECK_STATUS(tandem_gpu_broad_phase_find(queries.near, &scene.instances, NULL, stream), TANDEM_OK);
  pairs = tandem_gpu_broad_phase_pairs(queries.near);
  CHECK_STATUS(tandem_gpu_contact_query_enqueue(queries.contacts, &scene.instances, &pairs, NULL, stream),
               TANDEM_OK);
  cuda_must(cudaStreamSynchronize(stream));
  CHECK_STATUS(tandem_gpu_contact_query_get_report(queries.contacts, &report), TANDEM_OK);
  CHECK(report.complete == 0 && report.needed.pairs > 2);
  tandem_gpu_query_options options = grouped_contacts();
  CHECK_STATUS(tandem_gpu_contact_query_enqueue(queries.contacts, &scene.instances, &pairs, &options, stream),
               TANDEM_OUT_OF_RANGE);
  options.leave_out_rings = 9;
  CHECK_STATUS(tandem_gpu_contact_query_find(queries.contacts, &scene.instances, &pairs, &options, stream),
               TANDEM_BAD_OPTION);
  options.leave_out_rings = 0;
  options.mode = 3;
  CHECK_STATUS(tandem_gpu_contact_query_find(queries.contacts, &scene.instances, &pairs, &options, stream),
               TANDEM_BAD_OPTION);
  options.struct_size = 12;
  CHECK_STATUS(tandem_gpu_contact_query_find(queries.contacts, &scene.instances, &pairs, &options, stream),
               TANDEM_BAD_STRUCT_SIZE);
  CHECK_STATUS(tandem_gpu_contact_query_find(queries.contacts, NULL, &pairs, NULL, stream),
               TANDEM_NULL_ARGUMENT);
  CHECK_STATUS(tandem_gpu_contact_query_find(queries.contacts, &scene.instances, NULL, NULL, stream),
               TANDEM_NULL_ARGUMENT);
  destroy(&queries);

  // Copies of a part of the assets, which die before the queries.
  tandem_upload_options contents = {sizeof contents, TANDEM_CONTENTS_EXACT_QUERIES};
  tandem_gpu_assets* part = NULL;
  CHECK_STATUS(tandem_gpu_assets_upload(assets, 3, &contents, stream, NULL, &part, NULL), TANDEM_OK);
  CHECK(tandem_gpu_assets_count(part) == 3 &&
        tandem_gpu_assets_bytes(part) < tandem_gpu_assets_bytes(gpu_assets));
  queries = make_queries();
  tandem_gpu_distance_query* distances = NULL;
  CHECK_STATUS(tandem_gpu_distance_query_create(NULL, &distances), TANDEM_OK);
  CHECK_STATUS(tandem_gpu_distance_query_set_assets(distances, part, stream), TANDEM_NO_AXIS_ALIGNED_BLOCKS);
  CHECK_STATUS(tandem_gpu_distance_query_find(distances, &scene.instances, &pairs, NULL, stream),
               TANDEM_ASSETS_MISSING);
  tandem_gpu_distance_query_destroy(distances);
  CHECK_STATUS(tandem_gpu_contact_query_set_assets(queries.contacts, part, stream), TANDEM_OK);
  tandem_gpu_assets_release(part);
  CHECK_STATUS(tandem_gpu_broad_phase_find(queries.near, &scene.instances, NULL, stream), TANDEM_OK);
  pairs = tandem_gpu_broad_phase_pairs(queries.near);
  options = grouped_contacts();
  CHECK_STATUS(tandem_gpu_contact_query_find(queries.contacts, &scene.instances, &pairs, &options, stream),
               TANDEM_OK);
  CHECK_STATUS(
      tandem_gpu_manifolds_find(queries.manifolds, &scene.instances, &pairs, queries.contacts, NULL, stream),
      TANDEM_ASSETS_MISSING);
  options.mode = TANDEM_BOXES;
  CHECK_STATUS(tandem_gpu_contact_query_find(queries.contacts, &scene.instances, &pairs, &options, stream),
               TANDEM_NO_AXIS_ALIGNED_BLOCKS);
  destroy(&queries);
  free_gpu_scene(&scene);
}

int main(int argc, char** argv) {
  if (argc != 2) return printf("usage: gpu_use_test ASSETS_FOLDER\n"), 1;
  if (!has_gpu()) return printf("there is no GPU\n"), NO_GPU;
  begin(argv[1]);
  test_steps();
  test_options();
  test_filters();
  test_a_graph();
  test_points_and_rays();
  test_distances_and_impacts();
  test_errors();
  end();
  return failures != 0;
}
