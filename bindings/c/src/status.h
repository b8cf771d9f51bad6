#pragma once
#include "tandem/formats/status.h"
#include "tandem/tandem.h"

namespace tandem::c {

/// The number that the interface has for it.
tandem_status to_c(Status status);

}  // namespace tandem::c
