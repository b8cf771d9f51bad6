#pragma once
#include <cstdint>

#include "dynamics/parallel/step_arrays.h"

/// Which pairs touch after a step, and which began or ended to touch in the last call: lists of records,
/// which nobody makes unless somebody asks.
namespace tandem::dynamics {

/// Returns whether a record is of a list: `is_listed` is one of its flags.
struct RecordIsListed {
  const PairRecord* records;
  bool PairRecord::*is_listed;
  TANDEM_HD bool operator()(std::uint32_t i) const { return records[i].*is_listed; }
};

TANDEM_HD inline const WorldTouch& row_of(const WorldTouch& touch) {
  return touch;
}
TANDEM_HD inline ObjectPair row_of(const PairRecord& record) {
  return record.pair;
}

/// Copies the rows of what is listed to the front of an array.
template <typename From, typename Row>
struct CopyListed {
  const From* from;
  const std::uint32_t* list;
  Row* to;
  TANDEM_HD void operator()(std::uint32_t i) const { to[i] = row_of(from[list[i]]); }
};

/// A new call begins: no pair has begun or ended to touch in it.
struct ForgetCall {
  PairRecord* records;
  TANDEM_HD void operator()(std::uint32_t i) const { records[i].began = records[i].ended = false; }
};

}  // namespace tandem::dynamics
