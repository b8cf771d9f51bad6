#include "handles.h"
#include "rows.h"

using namespace tandem;
using namespace tandem::c;

tandem_status tandem_excluded_pairs_create(const tandem_object_pair* pairs, size_t count,
                                           const tandem_allocator* allocator,
                                           tandem_excluded_pairs** excluded) {
  return create(allocator, excluded, [&](tandem_excluded_pairs& made) -> tandem_status {
    return is_there(pairs, count) ? to_c(made.table.set(rows<ObjectPair>(pairs, count)))
                                  : tandem_status{TANDEM_NULL_ARGUMENT};
  });
}

void tandem_excluded_pairs_destroy(tandem_excluded_pairs* excluded) {
  if (excluded != nullptr && excluded->references.fetch_sub(1, std::memory_order_acq_rel) == 1)
    delete excluded;
}
