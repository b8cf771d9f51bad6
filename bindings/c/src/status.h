#pragma once
#include "tandem/formats/status.h"
#include "tandem/tandem.h"

namespace tandem::c {

/// The number that the interface has for it.
tandem_status to_c(Status status);

/// The libraries' status with that number; false where the interface alone has it, or nobody.
bool from_c(tandem_status number, Status& status);

}  // namespace tandem::c
