#pragma once
#include <stdexcept>

#include "build/sample_asset.h"

namespace tandem::test {

/// A mesh as the level 0 of a checked file.
class StoredLevel {
 public:
  explicit StoredLevel(const Mesh& mesh, build::Effort effort = build::Effort::fast)
      : file_(make_file(mesh, build::Imaginary::minimal, effort)) {
    const CheckResult checked = file_.check();
    if (checked.status != Status::kOk) throw std::runtime_error(name(checked.status));
    asset_ = checked.asset;
    view_ = asset_.level();
  }

  const AssetView& asset() const { return asset_; }
  const LevelView& view() const { return view_; }

  /// Returns the level without topology.
  LevelView triangles_only() const {
    LevelView view = view_;
    view.topology = nullptr;
    view.components = nullptr;
    view.vertex_count = view.component_count = 0;
    return view;
  }

 private:
  Bytes file_;
  AssetView asset_;
  LevelView view_;
};

}  // namespace tandem::test
