#include "hdf5_file.h"

#include <fcntl.h>
#include <hdf5.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <limits>
#include <system_error>

#include "common/output_file.h"

namespace tandem::bench {
namespace {

static_assert(std::is_same_v<hid_t, std::int64_t>);

// Owns an identifier of HDF5.
class Handle {
 public:
  Handle(hid_t id, herr_t (*close)(hid_t)) : id_(id), close_(close) {}
  Handle(Handle&& other) noexcept : id_(std::exchange(other.id_, -1)), close_(other.close_) {}
  Handle(const Handle&) = delete;
  Handle& operator=(const Handle&) = delete;
  ~Handle() {
    if (id_ >= 0) close_(id_);
  }
  operator hid_t() const { return id_; }

 private:
  hid_t id_;
  herr_t (*close_)(hid_t);
};

// Returns what HDF5 says of the call that failed last; its innermost message tells most.
std::string last_reason() {
  std::string reason;
  const auto take_first = [](unsigned, const H5E_error2_t* error, void* text) -> herr_t {
    auto& taken = *static_cast<std::string*>(text);
    if (taken.empty() && error->desc != nullptr) taken = error->desc;
    return 0;
  };
  H5Ewalk2(H5E_DEFAULT, H5E_WALK_UPWARD, take_first, &reason);
  return reason.empty() ? "HDF5 gives no reason" : "HDF5: " + reason;
}

// HDF5 prints its errors unless told not to.
void silence() {
  H5Eset_auto2(H5E_DEFAULT, nullptr, nullptr);
}

std::string reason_of(int error) {
  return std::system_category().message(error);
}

// The size of a regular file that can be read.
std::uint64_t size_of(const std::string& path) {
  struct stat info {};
  if (::stat(path.c_str(), &info) != 0) {
    throw FileError(path + ": " + (errno == ENOENT ? "no such file" : reason_of(errno)));
  }
  if (S_ISDIR(info.st_mode)) throw FileError(path + ": is a folder");
  if (!S_ISREG(info.st_mode)) throw FileError(path + ": not a regular file");
  const int file = ::open(path.c_str(), O_RDONLY | O_CLOEXEC);
  if (file < 0) throw FileError(path + ": " + reason_of(errno));
  ::close(file);
  return static_cast<std::uint64_t>(info.st_size);
}

// Access to links or datasets, by the class of property list: links that lead into other files lead nowhere.
Handle access_within(hid_t list_class) {
  Handle access(H5Pcreate(list_class), H5Pclose);
  const auto refuse = [](const char*, const char*, const char*, const char*, unsigned*, hid_t,
                         void*) -> herr_t { return -1; };
  H5Pset_elink_cb(access, refuse, nullptr);
  return access;
}

const char* words_for(H5T_class_t type) {
  switch (type) {
    case H5T_INTEGER:
      return "integers";
    case H5T_FLOAT:
      return "floating-point numbers";
    case H5T_STRING:
      return "strings";
    case H5T_COMPOUND:
      return "compound values";
    case H5T_ENUM:
      return "an enumeration";
    case H5T_ARRAY:
      return "arrays";
    case H5T_VLEN:
      return "sequences of variable length";
    default:
      return "values of another kind";
  }
}

// "n x 3 x 3": a dataset of any number of rows.
std::string words_for(const Shape& shape, bool any_rows) {
  std::string words;
  for (std::size_t i = 0; i < shape.size(); ++i) {
    words += (i == 0 ? "" : " x ") + (i == 0 && any_rows ? std::string("n") : std::to_string(shape[i]));
  }
  return words;
}

// A product that stops at the largest number there is.
std::uint64_t product(std::span<const std::uint64_t> factors) {
  std::uint64_t product = 1;
  for (const std::uint64_t factor : factors) {
    if (factor == 0) return 0;
    product = product > ~std::uint64_t{0} / factor ? ~std::uint64_t{0} : product * factor;
  }
  return product;
}

// A transfer during which a value that does not survive conversion is an error.
Handle lossless_transfer() {
  Handle transfer(H5Pcreate(H5P_DATASET_XFER), H5Pclose);
  const auto abort = [](H5T_conv_except_t, hid_t, hid_t, void*, void*, void*) { return H5T_CONV_ABORT; };
  H5Pset_type_conv_cb(transfer, abort, nullptr);
  return transfer;
}

}  // namespace

struct Hdf5Input::Dataset {
  std::string name;
  Handle id, type;
  Shape shape;

  H5T_class_t type_class() const { return H5Tget_class(type); }
  std::size_t count() const { return product(shape); }
};

Hdf5Input::Hdf5Input(const std::string& path) : path_(path), bytes_(size_of(path)) {
  silence();
  if (H5Fis_hdf5(path.c_str()) == 0) throw FileError(path + ": not an HDF5 file");
  file_ = H5Fopen(path.c_str(), H5F_ACC_RDONLY, H5P_DEFAULT);
  if (file_ < 0) throw FileError(path + ": " + last_reason());
}

Hdf5Input::~Hdf5Input() {
  H5Fclose(file_);
}

void Hdf5Input::refuse(const std::string& name, const std::string& reason) const {
  throw FileError(path_ + ": " + name + ": " + reason);
}

bool Hdf5Input::has(const std::string& name) const {
  const Handle links = access_within(H5P_LINK_ACCESS);
  for (std::size_t end = name.find('/', 1);; end = name.find('/', end + 1)) {
    if (H5Lexists(file_, name.substr(0, end).c_str(), links) <= 0) return false;
    if (end == std::string::npos) return true;
  }
}

Hdf5Input::Dataset Hdf5Input::open(const std::string& name, const Shape& row) const {
  if (!has(name)) refuse(name, "no such dataset");
  // Named, because closing a temporary list would take the reason of a failure away.
  const Handle links = access_within(H5P_LINK_ACCESS), access = access_within(H5P_DATASET_ACCESS);
  const Handle object(H5Oopen(file_, name.c_str(), links), H5Oclose);
  if (object < 0) refuse(name, last_reason());
  if (H5Iget_type(object) != H5I_DATASET) refuse(name, "not a dataset");
  Handle id(H5Dopen2(file_, name.c_str(), access), H5Dclose);
  if (id < 0) refuse(name, last_reason());
  Handle type(H5Dget_type(id), H5Tclose);
  const Handle space(H5Dget_space(id), H5Sclose);
  const int rank = space < 0 ? -1 : H5Sget_simple_extent_ndims(space);
  if (type < 0 || rank < 0) refuse(name, last_reason());
  if (rank != static_cast<int>(row.size()) + 1) {
    refuse(name, "expected " + std::to_string(row.size() + 1) +
                     (row.empty() ? " dimension, found " : " dimensions, found ") + std::to_string(rank));
  }
  std::vector<hsize_t> lengths(static_cast<std::size_t>(rank));
  H5Sget_simple_extent_dims(space, lengths.data(), nullptr);
  Dataset dataset{name, std::move(id), std::move(type), Shape(lengths.begin(), lengths.end())};
  if (!std::equal(row.begin(), row.end(), dataset.shape.begin() + 1)) {
    Shape expected = {0};
    expected.insert(expected.end(), row.begin(), row.end());
    refuse(name, "expected " + words_for(expected, true) + ", found " + words_for(dataset.shape, false));
  }
  check_extent(dataset);
  return dataset;
}

// Refuses what claims to be larger than its storage, and what lies in other files.
void Hdf5Input::check_extent(const Dataset& dataset) const {
  constexpr std::uint64_t kBestDeflate = 1032;  // no stream of zlib's grows by more
  const Handle creation(H5Dget_create_plist(dataset.id), H5Pclose);
  const H5D_layout_t layout = H5Pget_layout(creation);
  if (layout == H5D_VIRTUAL || H5Pget_external_count(creation) != 0) {
    refuse(dataset.name, "its values lie in other files, which are not read");
  }
  const std::uint64_t growth = H5Pget_nfilters(creation) > 0 ? kBestDeflate : 1;
  const std::uint64_t stored = std::min<std::uint64_t>(H5Dget_storage_size(dataset.id), bytes_);
  const std::uint64_t element = H5Tis_variable_str(dataset.type) > 0 ? 1 : H5Tget_size(dataset.type);
  Shape claimed = dataset.shape;
  claimed.push_back(element);
  if (product(claimed) > stored * growth) {
    refuse(dataset.name,
           "its shape, " + words_for(dataset.shape, false) + ", asks for more values than the file holds");
  }
  if (layout != H5D_CHUNKED) return;
  std::vector<hsize_t> chunk(dataset.shape.size());
  H5Pget_chunk(creation, static_cast<int>(chunk.size()), chunk.data());
  Shape chunk_bytes(chunk.begin(), chunk.end());
  chunk_bytes.push_back(element);
  if (dataset.count() > 0 && product(chunk_bytes) > stored * growth) {
    refuse(dataset.name, "its chunks are larger than the file");
  }
}

void Hdf5Input::read(const Dataset& dataset, std::int64_t memory_type, void* values) const {
  if (dataset.count() == 0) return;
  const Handle transfer = lossless_transfer();
  if (H5Dread(dataset.id, memory_type, H5S_ALL, H5S_ALL, transfer, values) < 0) {
    refuse(dataset.name, last_reason());
  }
}

Hdf5Input::Dataset Hdf5Input::open_integers(const std::string& name, const Shape& row) const {
  Dataset dataset = open(name, row);
  const H5T_class_t type = dataset.type_class();
  if (type != H5T_INTEGER) refuse(name, std::string("expected integers, found ") + words_for(type));
  return dataset;
}

std::vector<std::uint32_t> Hdf5Input::read_u32(const std::string& name, const Shape& row) const {
  const Dataset dataset = open_integers(name, row);
  std::vector<std::uint32_t> values(dataset.count());
  read(dataset, H5T_NATIVE_UINT32, values.data());
  return values;
}

std::vector<std::uint64_t> Hdf5Input::read_u64(const std::string& name, const Shape& row) const {
  const Dataset dataset = open_integers(name, row);
  std::vector<std::uint64_t> values(dataset.count());
  read(dataset, H5T_NATIVE_UINT64, values.data());
  return values;
}

Hdf5Input::Dataset Hdf5Input::open_numbers(const std::string& name, const Shape& row) const {
  Dataset dataset = open(name, row);
  const H5T_class_t type = dataset.type_class();
  if (type != H5T_FLOAT && type != H5T_INTEGER) {
    refuse(name, std::string("expected floating-point numbers, found ") + words_for(type));
  }
  if (type == H5T_FLOAT && H5Tget_size(dataset.type) > sizeof(double)) {
    refuse(name, "floating-point numbers of more than 64 bits");
  }
  return dataset;
}

std::vector<double> Hdf5Input::read_f64(const std::string& name, const Shape& row) const {
  const Dataset dataset = open_numbers(name, row);
  std::vector<double> values(dataset.count());
  read(dataset, H5T_NATIVE_DOUBLE, values.data());
  return values;
}

std::uint64_t Hdf5Input::count_rows(const std::string& name, const Shape& row) const {
  return open_numbers(name, row).shape[0];
}

std::vector<double> Hdf5Input::read_f64_row(const std::string& name, const Shape& row,
                                            std::uint64_t index) const {
  const Dataset dataset = open_numbers(name, row);
  std::vector<double> values(product(row));
  if (values.empty()) return values;
  Shape first(row.size() + 1, 0), one = row;
  first[0] = index;
  one.insert(one.begin(), 1);
  const std::vector<hsize_t> start(first.begin(), first.end()), count(one.begin(), one.end());
  const Handle in_file(H5Dget_space(dataset.id), H5Sclose),
      transfer = lossless_transfer(),
      in_memory(H5Screate_simple(static_cast<int>(count.size()), count.data(), nullptr), H5Sclose);
  if (H5Sselect_hyperslab(in_file, H5S_SELECT_SET, start.data(), nullptr, count.data(), nullptr) < 0 ||
      H5Dread(dataset.id, H5T_NATIVE_DOUBLE, in_memory, in_file, transfer, values.data()) < 0)
    refuse(name, last_reason());
  return values;
}

std::vector<std::string> Hdf5Input::names_in(const std::string& group) const {
  std::vector<std::string> names;
  if (!has(group)) return names;
  const Handle links = access_within(H5P_LINK_ACCESS);
  const Handle object(H5Oopen(file_, group.c_str(), links), H5Oclose);
  if (object < 0) refuse(group, last_reason());
  if (H5Iget_type(object) != H5I_GROUP) refuse(group, "not a group");
  const auto add = [](hid_t, const char* name, const H5L_info_t*, void* to) -> herr_t {
    static_cast<std::vector<std::string>*>(to)->emplace_back(name);
    return 0;
  };
  if (H5Literate(object, H5_INDEX_NAME, H5_ITER_INC, nullptr, add, &names) < 0) refuse(group, last_reason());
  return names;
}

std::vector<std::string> Hdf5Input::read_strings(const std::string& name) const {
  const Dataset dataset = open(name, {});
  const H5T_class_t type = dataset.type_class();
  if (type != H5T_STRING) refuse(name, std::string("expected strings, found ") + words_for(type));
  return H5Tis_variable_str(dataset.type) > 0 ? read_variable(dataset) : read_fixed(dataset);
}

std::vector<std::string> Hdf5Input::read_fixed(const Dataset& dataset) const {
  const std::size_t length = H5Tget_size(dataset.type);
  std::string all(dataset.count() * length, '\0');
  read(dataset, dataset.type, all.data());
  std::vector<std::string> strings;
  for (std::size_t i = 0; i < dataset.count(); ++i) {
    std::string text = all.substr(i * length, length);
    text.resize(std::min(text.size(), text.find('\0')));
    if (H5Tget_strpad(dataset.type) == H5T_STR_SPACEPAD) text.resize(text.find_last_not_of(' ') + 1);
    strings.push_back(std::move(text));
  }
  return strings;
}

std::vector<std::string> Hdf5Input::read_variable(const Dataset& dataset) const {
  if (dataset.count() == 0) return {};
  const Handle space(H5Dget_space(dataset.id), H5Sclose);
  hsize_t bytes = 0;  // many elements may share one place in the file
  if (H5Dvlen_get_buf_size(dataset.id, dataset.type, space, &bytes) < 0) refuse(dataset.name, last_reason());
  if (bytes > bytes_) refuse(dataset.name, "its strings are longer than the file");
  std::vector<char*> texts(dataset.count(), nullptr);
  read(dataset, dataset.type, texts.data());
  std::vector<std::string> strings;
  for (const char* text : texts) strings.emplace_back(text == nullptr ? "" : text);
  H5Dvlen_reclaim(dataset.type, space, H5P_DEFAULT, texts.data());
  return strings;
}

void try_output(const std::string& path) {
  const std::string reason = try_whole_file(path);
  if (!reason.empty()) throw OutputError(path + ": " + reason);
}

std::string Hdf5Input::read_attribute(const std::string& name) const {
  const std::string where = "attribute " + name;
  if (H5Aexists(file_, name.c_str()) <= 0) refuse(where, "there is none");
  const Handle attribute(H5Aopen(file_, name.c_str(), H5P_DEFAULT), H5Aclose);
  if (attribute < 0) refuse(where, last_reason());
  const Handle type(H5Aget_type(attribute), H5Tclose), space(H5Aget_space(attribute), H5Sclose);
  if (type < 0 || space < 0) refuse(where, last_reason());
  if (H5Tis_variable_str(type) <= 0 || H5Sget_simple_extent_npoints(space) != 1)
    refuse(where, "not one string");
  char* text = nullptr;
  if (H5Aread(attribute, type, &text) < 0 || text == nullptr) refuse(where, last_reason());
  const std::string value = text;
  H5free_memory(text);
  return value;
}

Hdf5Output::Hdf5Output(const std::string& path) : path_(path) {
  constexpr std::size_t kGrowth = std::size_t{1} << 20;
  silence();
  const Handle access(H5Pcreate(H5P_FILE_ACCESS), H5Pclose);
  H5Pset_fapl_core(access, kGrowth, false);
  file_ = H5Fcreate(path.c_str(), H5F_ACC_TRUNC, H5P_DEFAULT, access);
  if (file_ < 0) refuse(last_reason());
}

Hdf5Output::~Hdf5Output() {
  H5Fclose(file_);
}

void Hdf5Output::refuse(const std::string& reason) const {
  throw OutputError(path_ + ": " + reason);
}

void Hdf5Output::add(const std::string& name, const Shape& shape, std::int64_t type, const void* values) {
  const std::vector<hsize_t> lengths(shape.begin(), shape.end());
  const Handle space(H5Screate_simple(static_cast<int>(lengths.size()), lengths.data(), nullptr), H5Sclose);
  const Handle links(H5Pcreate(H5P_LINK_CREATE), H5Pclose), creation(H5Pcreate(H5P_DATASET_CREATE), H5Pclose);
  H5Pset_create_intermediate_group(links, 1);
  H5Pset_obj_track_times(creation, false);
  const Handle dataset(H5Dcreate2(file_, name.c_str(), type, space, links, creation, H5P_DEFAULT), H5Dclose);
  if (dataset < 0) refuse(last_reason());
  if (product(shape) == 0) return;
  if (H5Dwrite(dataset, type, H5S_ALL, H5S_ALL, H5P_DEFAULT, values) < 0) refuse(last_reason());
}

void Hdf5Output::add(const std::string& name, const Shape& shape, std::span<const std::uint8_t> values) {
  add(name, shape, H5T_STD_U8LE, values.data());
}

void Hdf5Output::add(const std::string& name, const Shape& shape, std::span<const std::uint32_t> values) {
  add(name, shape, H5T_STD_U32LE, values.data());
}

void Hdf5Output::add(const std::string& name, const Shape& shape, std::span<const std::uint64_t> values) {
  add(name, shape, H5T_STD_U64LE, values.data());
}

void Hdf5Output::add(const std::string& name, const Shape& shape, std::span<const double> values) {
  add(name, shape, H5T_IEEE_F64LE, values.data());
}

void Hdf5Output::add(const std::string& name, const std::vector<std::string>& strings) {
  std::size_t length = 1;
  for (const std::string& text : strings) length = std::max(length, text.size());
  std::string all;
  for (const std::string& text : strings) (all += text).append(length - text.size(), '\0');
  const Handle type(H5Tcopy(H5T_C_S1), H5Tclose);
  H5Tset_size(type, length);
  H5Tset_strpad(type, H5T_STR_NULLPAD);
  H5Tset_cset(type, H5T_CSET_UTF8);
  add(name, {strings.size()}, type, all.data());
}

void Hdf5Output::attribute(const std::string& name, std::int64_t type, const void* value) {
  const Handle space(H5Screate(H5S_SCALAR), H5Sclose);
  const Handle attribute(H5Acreate2(file_, name.c_str(), type, space, H5P_DEFAULT, H5P_DEFAULT), H5Aclose);
  if (attribute < 0 || H5Awrite(attribute, type, value) < 0) refuse(last_reason());
}

void Hdf5Output::attribute(const std::string& name, std::uint64_t value) {
  attribute(name, H5T_STD_U64LE, &value);
}

void Hdf5Output::attribute(const std::string& name, double value) {
  attribute(name, H5T_IEEE_F64LE, &value);
}

void Hdf5Output::attribute(const std::string& name, const std::string& value) {
  const Handle type(H5Tcopy(H5T_C_S1), H5Tclose);
  H5Tset_size(type, H5T_VARIABLE);
  H5Tset_cset(type, H5T_CSET_UTF8);
  const char* text = value.c_str();
  attribute(name, type, &text);
}

void Hdf5Output::attributes(const Report& report) {
  for (const auto& [key, value, in_json, in_file] : report.entries()) {
    if (!in_file) continue;
    if (value.is_object()) {
      attribute("best_" + key, value["best"].get<double>());
      attribute("median_" + key, value["median"].get<double>());
    } else if (value.is_string()) {
      attribute(key, value.get<std::string>());
    } else if (value.is_number_float()) {
      attribute(key, value.get<double>());
    } else if (!value.is_null()) {
      attribute(key, value.is_boolean() ? std::uint64_t{value.get<bool>()} : value.get<std::uint64_t>());
    }
  }
}

std::vector<std::byte> Hdf5Output::image() {
  if (H5Fflush(file_, H5F_SCOPE_GLOBAL) < 0) refuse(last_reason());
  const ssize_t bytes = H5Fget_file_image(file_, nullptr, 0);
  if (bytes < 0) refuse(last_reason());
  std::vector<std::byte> image(static_cast<std::size_t>(bytes));
  if (H5Fget_file_image(file_, image.data(), image.size()) < 0) refuse(last_reason());
  return image;
}

void Hdf5Output::write() {
  const std::string reason = write_whole_file(path_, image());
  if (!reason.empty()) refuse(reason);
}

}  // namespace tandem::bench
