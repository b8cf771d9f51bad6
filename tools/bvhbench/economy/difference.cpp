#include "difference.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <numbers>
#include <span>
#include <tuple>

namespace tandem::economy {
namespace {

std::uint64_t count_missing(const std::vector<ObjectPair>& a, const std::vector<ObjectPair>& b) {
  std::vector<ObjectPair> missing;
  std::set_difference(a.begin(), a.end(), b.begin(), b.end(), std::back_inserter(missing));
  return missing.size();
}

double squared_distance(const std::array<double, 3>& a, const std::array<double, 3>& b) {
  double sum = 0;
  for (int k = 0; k < 3; ++k) sum += (a[k] - b[k]) * (a[k] - b[k]);
  return sum;
}

// Returns the angle between unit vectors, in degrees, by the arc's chord: the cosine of a small angle has no
// digits of it.
double angle_between(const std::array<double, 3>& a, const std::array<double, 3>& b) {
  const double chord = std::sqrt(squared_distance(a, b));
  return 2 * std::asin(std::min(1.0, 0.5 * chord)) * 180 / std::numbers::pi;
}

using Patches = std::span<const Patch>;

// Collects what the manifolds of one object pair after the other differ by.
class Matches {
 public:
  void add(const ObjectPair& pair, Patches finest, Patches coarser) {
    struct Candidate {
      double squared;
      std::size_t i, j;
    };
    std::vector<Candidate> candidates;
    for (std::size_t i = 0; i < finest.size(); ++i) {
      for (std::size_t j = 0; j < coarser.size(); ++j)
        candidates.push_back({squared_distance(finest[i].centre, coarser[j].centre), i, j});
    }
    std::sort(candidates.begin(), candidates.end(), [](const Candidate& a, const Candidate& b) {
      return std::tie(a.squared, a.i, a.j) < std::tie(b.squared, b.i, b.j);
    });
    std::vector<bool> of_finest(finest.size()), of_coarser(coarser.size());
    for (const auto& [squared, i, j] : candidates) {
      if (of_finest[i] || of_coarser[j]) continue;
      of_finest[i] = of_coarser[j] = true;
      ++found_.matched;
      angles_.push_back(angle_between(finest[i].normal, coarser[j].normal));
      found_.depths.push_back({pair, std::fabs(finest[i].depth - coarser[j].depth)});
    }
    found_.lost_patches += add_unmatched(pair, finest, of_finest);
    found_.new_patches += add_unmatched(pair, coarser, of_coarser);
  }

  Difference result() const {
    Difference all = found_;
    all.angle = spread_of(angles_);
    std::vector<double> depths;
    for (const DepthChange& change : all.depths) depths.push_back(change.by);
    all.depth = spread_of(std::move(depths));
    return all;
  }

 private:
  std::uint64_t add_unmatched(const ObjectPair& pair, Patches patches, const std::vector<bool>& matched) {
    std::uint64_t count = 0;
    for (std::size_t i = 0; i < patches.size(); ++i) {
      if (matched[i]) continue;
      found_.depths.push_back({pair, patches[i].depth});
      ++count;
    }
    return count;
  }

  Difference found_;
  std::vector<double> angles_;
};

std::vector<Patch> by_pair(std::vector<Patch> patches) {
  std::stable_sort(patches.begin(), patches.end(),
                   [](const Patch& a, const Patch& b) { return a.pair < b.pair; });
  return patches;
}

// Takes the patches of `pair` off the front of `rest`.
Patches take(Patches& rest, const ObjectPair& pair) {
  std::size_t count = 0;
  while (count < rest.size() && rest[count].pair == pair) ++count;
  const Patches taken = rest.first(count);
  rest = rest.subspan(count);
  return taken;
}

}  // namespace

Spread spread_of(std::vector<double> numbers) {
  if (numbers.empty()) return {};
  std::sort(numbers.begin(), numbers.end());
  double sum = 0;
  for (const double number : numbers) sum += number;
  const std::size_t count = numbers.size();
  const auto of_smallest = [&](std::size_t percent) { return numbers[(percent * count + 99) / 100 - 1]; };
  return {sum / static_cast<double>(count), of_smallest(50), of_smallest(95), numbers.back()};
}

Difference difference(const Findings& finest, const Findings& coarser) {
  const std::vector<Patch> sorted = by_pair(finest.patches), sorted_coarser = by_pair(coarser.patches);
  Patches left = sorted, right = sorted_coarser;
  Matches matches;
  while (!left.empty() || !right.empty()) {
    const bool from_left = right.empty() || (!left.empty() && left[0].pair <= right[0].pair);
    const ObjectPair pair = from_left ? left[0].pair : right[0].pair;
    const Patches of_finest = take(left, pair), of_coarser = take(right, pair);
    matches.add(pair, of_finest, of_coarser);
  }
  Difference all = matches.result();
  all.touching_pairs = finest.touching.size();
  all.lost_pairs = count_missing(finest.touching, coarser.touching);
  all.new_pairs = count_missing(coarser.touching, finest.touching);
  return all;
}

}  // namespace tandem::economy
