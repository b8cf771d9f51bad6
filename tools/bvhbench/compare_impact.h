#pragma once
#include <cstdint>
#include <string>
#include <vector>

#include "common/report.h"
#include "timed_work.h"

namespace tandem::bench {

/// The results of one library for the times of impact of a scene. They are judged by what Tandem certifies,
/// no contact until then, and by contacts that its exact query finds later in the step.
struct ImpactPeer : PeerTimes {
  std::uint64_t found = 0;     ///< pairs with a time of impact
  std::uint64_t invented = 0;  ///< of them, those that surely have no contact in the step
  std::uint64_t missed = 0;    ///< pairs without one, though a contact was found
  std::uint64_t late = 0;      ///< pairs whose time is after that of a contact that was found
  /// These say how early or late times are that are surely early or late, in parts of the step.
  double median_early = 0, most_early = 0, most_late = 0;
};

/// The times of impact of a scene's bodies through all libraries, same object pairs, one thread, side by
/// side.
struct ImpactComparison {
  std::string name;  ///< of the scene file, without folder and ending
  double duration = 0;
  std::uint64_t instances = 0, object_pairs = 0;
  std::uint64_t at_start = 0;    ///< pairs in contact at the start
  std::uint64_t stopped = 0;     ///< pairs that Tandem stops later
  std::uint64_t in_contact = 0;  ///< of these, those of which a contact was found after that
  std::vector<ImpactPeer> peers;
};

/// Moves a scene's bodies as its file says for a step of `duration` seconds. Throws FileError of a scene that
/// cannot be compared, std::runtime_error of a library.
ImpactComparison compare_impacts(const std::string& path, double duration, unsigned repeats);

/// Makes the report, whose text has a line for each library.
Report report_of(const ImpactComparison& comparison);

}  // namespace tandem::bench
