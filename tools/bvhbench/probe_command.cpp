#include <algorithm>
#include <cmath>
#include <filesystem>
#include <numeric>
#include <random>
#include <sstream>

#include "bvhbench/engines/registry.h"
#include "common/number_words.h"
#include "common/output_file.h"
#include "question.h"
#include "timed_work.h"

namespace tandem::bench {
namespace {

using Point = std::array<double, 3>;

struct ProbeArguments : CommonArguments {
  std::uint32_t points = 1'000'000, rays = 1'000'000;
  std::uint64_t seed = 1;
  double tolerance = 1e-6;
  std::vector<std::string> peers;
};

/// The points and rays of a run, float32 numbers, so that all libraries are asked the same.
struct Probes {
  std::vector<Point> points, origins, directions;
};

/// The results of one library. Different from Tandem's are a distance or parameter that is farther from it
/// than float32 explains (kFloat32Error of the scene's size), and a hit where it has none or the reverse.
struct ProbePeer : PeerTimes {
  Seconds ray_seconds;
  std::uint64_t hits = 0, different_points = 0, different_rays = 0;
};

constexpr double kFloat32Error = 1e-4;

/// A box of all bodies' posed bounds.
struct Bounds {
  Point lo, hi;
};

Bounds bounds_of(const LoadedScene& scene) {
  Bounds out;
  out.lo.fill(HUGE_VAL);
  out.hi.fill(-HUGE_VAL);
  for (const Instance& body : scene.description.instances) {
    const FileHeader& header = *scene.view(body.asset).header;
    for (int corner = 0; corner < 8; ++corner) {
      double at[3], posed[3];
      for (int k = 0; k < 3; ++k)
        at[k] = header.origin[k] + double{(corner >> k & 1) != 0 ? header.upper[k] : header.lower[k]};
      apply(body.pose, at[0], at[1], at[2], posed);
      for (int k = 0; k < 3; ++k) {
        out.lo[k] = std::min(out.lo[k], posed[k]);
        out.hi[k] = std::max(out.hi[k], posed[k]);
      }
    }
  }
  return out;
}

double as_float32(double x) {
  return static_cast<double>(static_cast<float>(x));
}

// Points lie in 1.5 times the bounds; rays go from a sphere around the bounds to a point in them.
Probes probes_in(const Bounds& bounds, const ProbeArguments& arguments) {
  std::mt19937_64 random(arguments.seed);
  const auto symmetric = [&] { return static_cast<double>(random() >> 11) * 0x1p-52 - 1; };
  Point centre, half;
  for (std::size_t k = 0; k < 3; ++k) {
    centre[k] = (bounds.lo[k] + bounds.hi[k]) / 2;
    half[k] = (bounds.hi[k] - bounds.lo[k]) / 2;
  }
  const double radius = 1.5 * std::hypot(half[0], half[1], half[2]);
  const auto in_bounds = [&](double size) {
    Point out;
    for (std::size_t k = 0; k < 3; ++k) out[k] = as_float32(centre[k] + size * half[k] * symmetric());
    return out;
  };
  Probes probes;
  for (std::uint32_t i = 0; i < arguments.points; ++i) probes.points.push_back(in_bounds(1.5));
  for (std::uint32_t i = 0; i < arguments.rays; ++i) {
    Point off;
    double length;
    do {
      off = {symmetric(), symmetric(), symmetric()};
      length = std::hypot(off[0], off[1], off[2]);
    } while (length > 1 || length < 0.1);
    const Point to = in_bounds(1);
    Point &from = probes.origins.emplace_back(), &along = probes.directions.emplace_back();
    for (std::size_t k = 0; k < 3; ++k) {
      from[k] = as_float32(centre[k] + radius / length * off[k]);
      along[k] = as_float32(to[k] - from[k]);
    }
  }
  return probes;
}

/// Runs of all libraries side by side, the first of which is Tandem.
std::vector<ProbePeer> race(const ProbeArguments& arguments, const LoadedScene& scene, const Probes& probes,
                            double size) {
  std::vector<std::string> libraries = {"tandem"};
  libraries.insert(libraries.end(), arguments.peers.begin(), arguments.peers.end());
  const auto engines = make_peers(ProbeOptions{{0, arguments.tolerance}}, libraries);
  const std::vector<AssetView> shapes = scene.views();
  std::vector<ProbePeer> peers = prepared<ProbePeer>(engines, shapes, scene.description.instances);
  std::vector<double> first_distances, first_times, found;
  const auto is_near = [&](double x, double y) { return x == y || std::abs(x - y) <= kFloat32Error * size; };
  for (std::uint32_t repeat = 0; repeat < arguments.repeats; ++repeat) {
    for (std::size_t i = 0; i < engines.size(); ++i) {
      ProbePeer& peer = peers[i];
      peer.query_seconds.push_back(seconds_of([&] { engines[i]->find_closest(probes.points, found); }));
      if (i == 0) first_distances = found;
      peer.different_points = 0;
      for (std::size_t p = 0; p < found.size(); ++p)
        peer.different_points += !is_near(found[p], first_distances[p]);
      peer.ray_seconds.push_back(
          seconds_of([&] { engines[i]->find_hits(probes.origins, probes.directions, found); }));
      if (i == 0) first_times = found;
      peer.hits = peer.different_rays = 0;
      for (std::size_t r = 0; r < found.size(); ++r) {
        const Point& along = probes.directions[r];
        const double length = std::hypot(along[0], along[1], along[2]);
        peer.hits += found[r] < HUGE_VAL;
        peer.different_rays += !is_near(length * found[r], length * first_times[r]);
      }
    }
  }
  return peers;
}

double least_of(const Seconds& seconds) {
  return seconds.empty() ? 0 : *std::min_element(seconds.begin(), seconds.end());
}

double nanoseconds_each(const Seconds& seconds, std::size_t count) {
  return count == 0 ? 0 : 1e9 * least_of(seconds) / static_cast<double>(count);
}

Report report_of(const ProbeArguments& arguments, const std::vector<ProbePeer>& peers) {
  Report report;
  report.line(arguments.scene + ": " + with_commas(arguments.points) + " points, " +
              with_commas(arguments.rays) + " rays, one thread");
  report.add({{"tool", "bvhbench probe"},
              {"version", TANDEM_VERSION},
              {"scene", arguments.scene},
              {"output", or_null(arguments.output)},
              {"points", arguments.points},
              {"rays", arguments.rays},
              {"seed", arguments.seed},
              {"relative_tolerance", arguments.tolerance},
              {"repeats", arguments.repeats}});
  report.line(format("%-12s%14s%14s%12s%18s%16s", "", "point, ns", "ray, ns", "hits", "different points",
                     "different rays"));
  Json rows = Json::array();
  for (const ProbePeer& peer : peers) {
    const double point = nanoseconds_each(peer.query_seconds, arguments.points);
    const double ray = nanoseconds_each(peer.ray_seconds, arguments.rays);
    report.line(format("%-12s%14.1f%14.1f%12llu%18llu%16llu", peer.name.c_str(), point, ray,
                       static_cast<unsigned long long>(peer.hits),
                       static_cast<unsigned long long>(peer.different_points),
                       static_cast<unsigned long long>(peer.different_rays)));
    rows.push_back({{"name", peer.name},
                    {"settings", peer.settings},
                    {"build_seconds", peer.build_seconds + peer.update_seconds},
                    {"point_nanoseconds", point},
                    {"ray_nanoseconds", ray},
                    {"hits", peer.hits},
                    {"different_points", peer.different_points},
                    {"different_rays", peer.different_rays}});
  }
  report.add("peers", std::move(rows));
  return report;
}

// A row for each library: docs/scenes.md.
void write_csv(const ProbeArguments& arguments, const std::vector<ProbePeer>& peers) {
  std::ostringstream rows;
  rows << "scene,peer,points,rays,point_ns,ray_ns,hits,different_points,different_rays\n";
  for (const ProbePeer& peer : peers) {
    rows << std::filesystem::path(arguments.scene).stem().string() << ',' << peer.name << ','
         << arguments.points << ',' << arguments.rays
         << format(",%.5g,%.5g,", nanoseconds_each(peer.query_seconds, arguments.points),
                   nanoseconds_each(peer.ray_seconds, arguments.rays))
         << peer.hits << ',' << peer.different_points << ',' << peer.different_rays << '\n';
  }
  const std::string text = rows.str();
  const std::string reason = write_whole_file(arguments.output, std::as_bytes(std::span(text)));
  if (!reason.empty()) throw OutputError(arguments.output + ": " + reason);
}

// A .bvh file is a scene of one body, which stands at the identity.
LoadedScene scene_of(const ProbeArguments& arguments) {
  if (std::filesystem::path(arguments.scene).extension() != ".bvh") return open_scene(arguments);
  check_output(arguments, {arguments.scene});
  LoadedScene scene;
  scene.add(open_mesh(arguments.scene));
  scene.description.instances = {{0, kIdentityPose}};
  return scene;
}

ExitCode run_probe(const ProbeArguments& arguments) {
  const LoadedScene scene = scene_of(arguments);
  const Bounds bounds = bounds_of(scene);
  const Probes probes = probes_in(bounds, arguments);
  const double size =
      std::hypot(bounds.hi[0] - bounds.lo[0], bounds.hi[1] - bounds.lo[1], bounds.hi[2] - bounds.lo[2]);
  const std::vector<ProbePeer> peers =
      answer_of(arguments.scene, scene, [&] { return race(arguments, scene, probes, size); });
  if (!arguments.output.empty()) write_csv(arguments, peers);
  print(arguments, report_of(arguments, peers));
  return kDone;
}

// The libraries that answer it.
std::vector<std::string> probing_libraries() {
  return is_built_in("embree") ? std::vector<std::string>{"embree"} : std::vector<std::string>{};
}

}  // namespace

void add_probe(Command tool, Run& run_later) {
  const auto [command, arguments] = add_command<ProbeArguments>(
      tool, run_later, "probe", "time closest points and rays, beside other libraries", run_probe);
  command.add(
      {scene_argument(arguments, "scene file (HDF5), or a mesh (.bvh)"),
       {"--points", arguments.points, "N [1000000]", "points in 1.5 times the bounds", between(0, 4e9)},
       {"--rays", arguments.rays, "N [1000000]", "rays from a sphere around the bounds into them",
        between(0, 4e9)},
       seed_option(arguments.seed, "the points and rays"),
       {"--tolerance", arguments.tolerance, "R [1e-6]",
        "how wide Tandem's interval of a distance may be, relative to it", between(0, 1)},
       separated_by_commas({"--peers", arguments.peers, "embree", "other libraries, on one thread",
                            one_of(probing_libraries())}),
       repeat_option(arguments, "all"),
       output_option(arguments, "the CSV file to write, a row for each library"),
       json_option(arguments)});
}

}  // namespace tandem::bench
