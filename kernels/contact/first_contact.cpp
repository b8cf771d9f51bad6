#include "kernels/contact/first_contact.h"

#include <algorithm>

#include "kernels/common/block_pair.h"

namespace tandem {

PairTask first_contact_task(const PosedTree& a, const PosedTree& b, double within) {
  PairTask task = pair_task(a, b, within);
  task.first_contact_only = true;
  if (task.in_frame && !task.self && task.within > 0)
    task.most_candidates =
        std::max(kLeastBeforeGivingUp, std::uint64_t{a.tree.triangle_count} + b.tree.triangle_count);
  return task;
}

bool FirstContact::grow(ContactSink& sink) {
  Buffer<Contact>& contacts = static_cast<FirstContact*>(sink.owner)->contacts_;
  const auto used = static_cast<std::size_t>(sink.next - contacts.data());
  if (!contacts.grow(used, 1)) return false;
  sink.next = contacts.data() + used;
  sink.end = contacts.data() + contacts.capacity();
  return true;
}

bool FirstContact::find(const PosedTree& a, const PosedTree& b, double within, bool& touch) {
  sink_.owner = this;
  sink_.grow = grow;
  sink_.next = contacts_.data();
  sink_.end = contacts_.data() + contacts_.capacity();
  const bool done =
      run_contact_task(first_contact_task(a, b, within), best_way(narrow_phase), sink_, waiting_);
  touch = sink_.next != contacts_.data();
  return done;
}

}  // namespace tandem
