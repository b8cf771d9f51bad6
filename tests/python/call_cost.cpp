// Prints the median time in microseconds of a call that finds the contacts of two bodies, through C++.
// Usage: call_cost ASSET.bvh
#include <algorithm>
#include <chrono>
#include <cstdio>
#include <vector>

#include "tandem/kernels/contact_query.h"
#include "tandem/kernels/scene.h"
#include "tandem/runtime/map.h"

int main(int argc, char** argv) {
  tandem::MappedAsset asset;
  if (argc != 2 || asset.open(argv[1]) != tandem::Status::kOk) return 1;
  const tandem::AssetView assets[] = {asset.view()};
  tandem::Instance bodies[2] = {};
  for (tandem::Instance& body : bodies) {
    for (int k = 0; k < 3; ++k) body.pose.rotation[k][k] = 1;
  }
  for (double& x : bodies[1].pose.translation) x = 0.5;
  tandem::Scene scene;
  tandem::ContactQuery query;
  if (scene.set_assets(assets) != tandem::Status::kOk) return 1;
  constexpr int kCalls = 500;
  std::vector<double> times;
  for (int repeat = 0; repeat < 51; ++repeat) {
    const auto start = std::chrono::steady_clock::now();
    for (int call = 0; call < kCalls; ++call) {
      if (scene.place(bodies) != tandem::Status::kOk) return 1;
      if (query.find(scene, tandem::ContactOptions()) != tandem::Status::kOk) return 1;
    }
    const std::chrono::duration<double, std::micro> taken = std::chrono::steady_clock::now() - start;
    times.push_back(taken.count() / kCalls);
  }
  std::nth_element(times.begin(), times.begin() + 25, times.end());
  std::printf("%.3f\n", times[25]);
}
