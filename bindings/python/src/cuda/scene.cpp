#include "scene.h"

#include <nanobind/stl/vector.h>

#include <string>
#include <utility>

namespace tandem::python {
namespace {

std::uint32_t count_of(std::int64_t length, const GivenArray& array) {
  if (length >= std::int64_t{TANDEM_NO_INDEX}) array.wrong_shape("fewer than 2^32 - 1 rows");
  return static_cast<std::uint32_t>(length);
}

}  // namespace

Assets::Assets(nb::list assets, int device, std::uint32_t contents, std::vector<std::uint32_t> deforming,
               bool takes_float64, const Stream& stream)
    : device_(require_gpu(device)), takes_float64_(takes_float64), deforming_(std::move(deforming)) {
  const OnDevice current(device);
  upload(assets, contents, stream);
  if (deforming_.empty()) return;
  tandem_gpu_assets* const at_rest = std::exchange(assets_, nullptr);
  std::uint64_t where = 0;
  const tandem_status status = [&] {
    const WithoutLock other_threads_run;
    const tandem_status made = tandem_gpu_assets_create_deforming(
        at_rest, deforming_.data(), deforming_.size(), takes_float64_, stream, nullptr, &assets_, &where);
    tandem_gpu_assets_release(at_rest);
    return made;
  }();
  const bool is_about_one = status == TANDEM_UNKNOWN_ASSET || status == TANDEM_NO_SOURCE_VERTICES;
  if (is_about_one) throw_status(status, tandem_status_explain(status), "asset", deforming_[where]);
  check_whole(status);
}

void Assets::upload(nb::list assets, std::uint32_t contents, const Stream& stream) {
  std::vector<tandem_asset*> list;
  for (nb::handle asset : assets) {
    list.push_back(nb::cast<const Asset&>(asset).get());
    auto info = sized<tandem_asset_info>();
    check(tandem_asset_get_info(list.back(), &info));
    source_vertices_.push_back(info.source_vertices);
  }
  const tandem_upload_options options = {sizeof options, contents};
  std::uint64_t where = 0;
  const tandem_status status = [&] {
    const WithoutLock other_threads_run;
    return tandem_gpu_assets_upload(list.data(), list.size(), &options, stream, nullptr, &assets_, &where);
  }();
  check(status, where);
}

std::shared_ptr<Buffer> Assets::zeros(std::size_t count) const {
  const std::size_t bytes = count * sizeof(std::uint32_t);
  if (zeros_ != nullptr && zeros_->bytes() >= bytes) return zeros_;
  const OnDevice current(device_);
  auto made = std::make_shared<Buffer>(bytes + bytes / 2);
  check_cuda(cudaMemset(made->data(), 0, made->bytes()));
  check_cuda(cudaDeviceSynchronize());
  return zeros_ = made;
}

// A status of the report comes with the vertex to blame, and another one with nothing.
void Assets::check_report(tandem_status status) const {
  tandem_gpu_deform_report report;
  if (status == TANDEM_OK || tandem_gpu_assets_get_report(assets_, &report) != status)
    return check_whole(status);
  throw_vertex(status, deforming_[report.body], report.where);
}

void Assets::deform(const Positions& positions, const Stream& stream) const {
  const Turn turn(busy_, kBusy);
  positions.require_assets(*this);
  const OnDevice current(device_);
  const tandem_status status = [&] {
    const WithoutLock other_threads_run;
    return tandem_gpu_assets_deform(assets_, positions.in_float32(), positions.in_float64(), stream);
  }();
  check_report(status);
}

void Assets::enqueue_deform(const Positions& positions, const Stream& stream) const {
  const Turn turn(busy_, kBusy);
  positions.require_assets(*this);
  const OnDevice current(device_);
  check_whole(
      tandem_gpu_assets_enqueue_deform(assets_, positions.in_float32(), positions.in_float64(), stream));
  is_queued_ = true;
}

void Assets::check_queued() const {
  if (is_queued_) check_report(tandem_gpu_assets_get_report(assets_, nullptr));
}

Positions::Positions(const Assets& assets, nb::list positions, const Stream& stream) : assets_(&assets) {
  count_ = assets.deforming().size();
  std::vector<const void*> places(2 * count_);  // in float32, then in float64
  for (std::size_t i = 0; i < count_; ++i) {
    const std::uint32_t asset = assets.deforming()[i];
    const nb::object given = positions[i];
    if (given.is_none()) continue;
    const std::string name = "positions of asset " + std::to_string(asset);
    GivenArray& array = arrays_.emplace_back(given, name.c_str(), stream, assets.device());
    if (assets.takes_float64())
      array.require_type({kF32, kF64}, "float32 or float64");
    else
      array.require_type({kF32}, "float32");
    const auto count = static_cast<std::int64_t>(assets.source_vertices(asset));
    if (array.shape() != std::vector<std::int64_t>{count, 3})
      array.wrong_shape(("(" + std::to_string(count) + ", 3)").c_str());
    const bool is_float64 = array.type() == kF64;
    has_float64_ = has_float64_ || is_float64;
    places[is_float64 ? count_ + i : i] = array.data();
  }
  const OnDevice current(assets.device());
  places_ = std::make_shared<Buffer>(places.size() * sizeof places[0]);
  check_cuda(
      cudaMemcpyAsync(places_->data(), places.data(), places_->bytes(), cudaMemcpyHostToDevice, stream));
  const cudaError_t error = [&] {
    const WithoutLock other_threads_run;
    return cudaStreamSynchronize(stream);
  }();
  check_cuda(error);
}

void Positions::require_assets(const Assets& assets) const {
  if (assets_ != &assets) throw nb::value_error("positions were made by another query");
}

Instances::Instances(const Assets& assets, nb::handle asset, nb::handle pose, const Stream& stream)
    : pose_(pose, "pose", stream, assets.device()), device_(assets.device()) {
  pose_.require_type({kF64}, "float64");
  const std::vector<std::int64_t>& shape = pose_.shape();
  const bool rows = shape.size() == 2 && shape[1] == 12;
  if (!rows && !(shape.size() == 3 && shape[1] == 4 && shape[2] == 3))
    pose_.wrong_shape("(n, 12) or (n, 4, 3)");
  instances_.pose = static_cast<const tandem_pose*>(pose_.data());
  instances_.count = count_of(shape[0], pose_);
  if (asset.is_none()) {
    zeros_ = assets.zeros(instances_.count);
    instances_.asset = static_cast<const std::uint32_t*>(zeros_->data());
    return;
  }
  asset_ = GivenArray(asset, "asset", stream, device_);
  asset_.require_type({kU32, kI32}, "uint32 or int32");
  if (asset_.shape().size() != 1 || asset_.shape()[0] != shape[0])
    asset_.wrong_shape(("(" + std::to_string(shape[0]) + ",)").c_str());
  instances_.asset = static_cast<const std::uint32_t*>(asset_.data());
}

const Instances& bodies_of(nb::handle instances, int device) {
  const Instances& bodies = nb::cast<const Instances&>(instances);
  require_device("instances", bodies.device(), device);
  return bodies;
}

Pairs::Pairs(nb::handle pairs, const Stream& stream, int device) : given_(pairs, "pairs", stream, device) {
  given_.require_type({kU32, kI32}, "uint32 or int32");
  const std::vector<std::int64_t>& shape = given_.shape();
  if (shape.size() != 2 || shape[1] != 2) given_.wrong_shape("(m, 2)");
  pairs_.pairs = static_cast<const tandem_object_pair*>(given_.data());
  pairs_.capacity = count_of(shape[0], given_);
}

GpuFilter::GpuFilter(nb::handle motion, nb::handle group, nb::handle mask, nb::handle world,
                     nb::handle excluded, const Stream& stream, int device)
    : device_(device) {
  filter_.struct_size = sizeof filter_;
  const auto take = [&](nb::handle given, const char* name, GivenArray& array,
                        std::initializer_list<dlpack::DataType> types, const char* wanted) {
    if (given.is_none()) return static_cast<const void*>(nullptr);
    array = GivenArray(given, name, stream, device);
    array.require_type(types, wanted);
    if (array.shape().size() != 1 || (count_ >= 0 && array.shape()[0] != count_))
      array.wrong_shape(count_ >= 0 ? ("(" + std::to_string(count_) + ",)").c_str() : "(n,)");
    count_ = array.shape()[0];
    return array.data();
  };
  filter_.motion = static_cast<const std::uint8_t*>(take(motion, "motion", motion_, {kU8}, "uint8"));
  const auto take_words = [&](nb::handle given, const char* name, GivenArray& array) {
    return static_cast<const std::uint32_t*>(take(given, name, array, {kU32, kI32}, "uint32 or int32"));
  };
  filter_.group = take_words(group, "group", group_);
  filter_.mask = take_words(mask, "mask", mask_);
  filter_.world = take_words(world, "world", world_);
  if (excluded.is_none()) return;
  const auto pairs = copy_rows<tandem_object_pair>(excluded);
  const OnDevice current(device);
  check(tandem_gpu_excluded_pairs_create(pairs.data(), pairs.size(), stream, nullptr, &excluded_));
  filter_.excluded = excluded_;
}

const tandem_gpu_pair_filter* GpuFilter::of(const GpuFilter* filter, const Instances& bodies) {
  if (filter == nullptr) return nullptr;
  require_device("filter", filter->device_, bodies.device());
  if (filter->count_ >= 0 && static_cast<std::size_t>(filter->count_) != bodies.count())
    throw nb::value_error(("filter is of " + std::to_string(filter->count_) + " instances where there are " +
                           std::to_string(bodies.count()))
                              .c_str());
  return &filter->filter_;
}

void add_scenes(nb::module_& module) {
  nb::class_<Assets>(module, "Assets")
      .def(nb::init<nb::list, int, std::uint32_t, std::vector<std::uint32_t>, bool, const Stream&>())
      .def("deform", &Assets::deform)
      .def("enqueue_deform", &Assets::enqueue_deform)
      .def_prop_ro("device", &Assets::device)
      .def_prop_ro("bytes", &Assets::bytes);
  nb::class_<Positions>(module, "Positions").def(nb::init<const Assets&, nb::list, const Stream&>());
  nb::class_<Instances>(module, "Instances")
      .def(nb::init<const Assets&, nb::handle, nb::handle, const Stream&>(), nb::arg(), nb::arg().none(),
           nb::arg(), nb::arg())
      .def("__len__", &Instances::count);
  nb::class_<Pairs>(module, "Pairs")
      .def(nb::init<nb::handle, const Stream&, int>())
      .def("__len__", &Pairs::count);
  nb::class_<GpuFilter>(module, "Filter")
      .def(nb::init<nb::handle, nb::handle, nb::handle, nb::handle, nb::handle, const Stream&, int>(),
           nb::arg().none(), nb::arg().none(), nb::arg().none(), nb::arg().none(), nb::arg().none(),
           nb::arg(), nb::arg());
}

}  // namespace tandem::python
