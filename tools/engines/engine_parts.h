#pragma once
#include <chrono>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "collision_engine.h"

namespace tandem::simulation {

/// Seconds since it was made, or since the last call of lap().
class Stopwatch {
 public:
  double lap() {
    const auto now = std::chrono::steady_clock::now();
    const double seconds = std::chrono::duration<double>(now - last_).count();
    last_ = now;
    return seconds;
  }

 private:
  std::chrono::steady_clock::time_point last_ = std::chrono::steady_clock::now();
};

/// Leaves out pairs of two idle bodies; order is kept. `idle`: as find() takes it.
void keep_active(std::span<const ObjectPair> pairs, std::span<const std::uint8_t> idle,
                 std::vector<ObjectPair>& kept);

/// Brings triangle contacts, in any order, into that of a ContactList.
void sort_contacts(std::vector<TriangleContact>& contacts);

/// Throws what a status other than kOk calls for. `where`: the body to blame, where there is one.
void require(std::string_view engine, Status status, std::uint64_t where);

/// The same of a call of this query.
inline void require(std::string_view engine, Status status, const ContactQuery& query) {
  require(engine, status, query.where());
}

std::unique_ptr<CollisionEngine> make_tandem_engine(const EngineOptions& options);

/// FCL, "Embree" and "Embree refit": peers of `bvhbench compare`. `peer`: its place in the peer list.
std::unique_ptr<CollisionEngine> make_peer_engine(std::string_view name, std::string_view library,
                                                  std::size_t peer);

/// Condition: the program has CUDA. name: tandem-cuda, paper or paper-bits.
std::unique_ptr<CollisionEngine> make_gpu_engine(std::string_view name, const EngineOptions& options);

}  // namespace tandem::simulation
