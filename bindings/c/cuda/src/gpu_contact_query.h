#pragma once
#include "gpu_handles.h"
#include "tandem/kernels/gpu_contact_query.h"

struct tandem_gpu_contact_query : tandem::c::GpuHandle<tandem::GpuContactQuery> {
  bool grouped = false;       ///< the contacts of the last call are
  bool all_contacts = false;  ///< and are all there are, without distance

  /// Whether what follows from contacts may be asked of it by a handle with these assets.
  tandem_status serves(const tandem_gpu_assets* with, bool needs_all) const {
    if (assets != with) return TANDEM_ASSETS_MISSING;
    return grouped && (all_contacts || !needs_all) ? TANDEM_OK : TANDEM_CONTACTS_MISSING;
  }
};
