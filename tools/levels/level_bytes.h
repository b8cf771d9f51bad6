#pragma once
#include "tandem/formats/view.h"

namespace tandem {

/// The bytes of one level's sections in its file.
inline std::uint64_t bytes_of_level(const AssetView& view, std::uint32_t level) {
  std::uint64_t bytes = 0;
  for (const Section& section : view.sections) {
    const bool of_the_file = section.kind == SectionKind::levels || section.kind == SectionKind::parts ||
                             section.kind == SectionKind::strings || section.kind == SectionKind::provenance;
    if (!of_the_file && section.level == level) bytes += section.bytes;
  }
  return bytes;
}

}  // namespace tandem
