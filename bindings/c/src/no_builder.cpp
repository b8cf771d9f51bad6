#include "tandem/tandem.h"

tandem_status tandem_asset_build(const tandem_mesh*, const tandem_build_options*, const tandem_allocator*,
                                 tandem_asset** asset, tandem_build_report*) {
  if (asset == nullptr) return TANDEM_NULL_ARGUMENT;
  *asset = nullptr;
  return TANDEM_NO_BUILDER;
}
