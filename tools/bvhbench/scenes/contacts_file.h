#pragma once
#include <span>

#include "contact_table.h"
#include "hdf5_file.h"
#include "tandem/kernels/containment_query.h"
#include "tandem/kernels/manifold.h"

namespace tandem::bench {

/// Adds the datasets of a contacts file (docs/scenes.md). Throws OutputError.
void add_contacts(Hdf5Output& file, const ContactTable& table);

/// Adds those of contact manifolds. Manifold::pair is a row of the table's pairs.
void add_manifolds(Hdf5Output& file, std::span<const Manifold> manifolds,
                   std::span<const ManifoldPoint> points);

/// Adds those of bodies within bodies. Containment::pair is a row of the table's pairs.
void add_contained(Hdf5Output& file, std::span<const Containment> rows);

}  // namespace tandem::bench
