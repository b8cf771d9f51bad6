#include "noise.h"

namespace tandem::makeassets {

double hashed(std::uint64_t key) {
  std::uint64_t h = key;
  h = (h ^ h >> 30) * 0xBF58476D1CE4E5B9u;  // finaliser of SplitMix64
  h = (h ^ h >> 27) * 0x94D049BB133111EBu;
  h ^= h >> 31;
  return static_cast<double>(h >> 11) / static_cast<double>(1ull << 52) - 1;
}

double fade(double t) {
  return t * t * t * (t * (t * 6 - 15) + 10);
}

}  // namespace tandem::makeassets
