// Contacts for MuJoCo: its rules for the parameters of a contact, and its struct mjContact, whose layout the
// package's Python files find out. Nothing of MuJoCo is linked.
#include <algorithm>
#include <cmath>
#include <cstring>
#include <optional>
#include <string>
#include <utility>

#include "touches.h"

namespace tandem::python {
namespace {

constexpr double kLeastFriction = 1e-5;  // mjMINMU
constexpr double kLeastMix = 1e-15;      // mjMINVAL
constexpr int kPlane = 0, kMesh = 7;     // mjGEOM_PLANE, mjGEOM_MESH

// An array of a model or of its options, as it is whenever it is read: `size` values for each row.
template <typename Value, std::size_t size = 1>
class Column {
 public:
  Column(nb::handle owner, const std::string& name) : bytes_(owner.attr(name.c_str())) {
    if (bytes_.size() % sizeof(Row) != 0) throw_broken_rows();
  }
  using Row = Value[size];
  const Row& operator[](std::size_t row) const { return static_cast<const Row*>(bytes_.data())[row]; }
  std::size_t count() const { return bytes_.size() / sizeof(Row); }

 private:
  Bytes bytes_;
};

// Geoms and explicit pairs both have these.
struct Properties {
  Properties(nb::handle model, const std::string& kind, const std::string& size)
      : dim(model, kind + size),
        solref(model, kind + "_solref"),
        solimp(model, kind + "_solimp"),
        margin(model, kind + "_margin"),
        gap(model, kind + "_gap"),
        adhesion(model, kind + "_adhesion") {}
  Column<std::int32_t> dim;
  Column<double, 2> solref;
  Column<double, 5> solimp;
  Column<double> margin, gap, adhesion;
};

struct Model {
  explicit Model(nb::handle model)
      : geom(model, "geom", "_condim"),
        pair(model, "pair", "_dim"),
        type(model, "geom_type"),
        priority(model, "geom_priority"),
        solmix(model, "geom_solmix"),
        friction(model, "geom_friction"),
        pair_friction(model, "pair_friction"),
        pair_solreffriction(model, "pair_solreffriction"),
        o_friction(model.attr("opt"), "o_friction"),
        o_solref(model.attr("opt"), "o_solref"),
        o_solimp(model.attr("opt"), "o_solimp") {
    if (nb::hasattr(model, "geom_surfacevel")) surfacevel.emplace(model, "geom_surfacevel");
  }
  Properties geom, pair;
  Column<std::int32_t> type, priority;
  Column<double> solmix;
  Column<double, 3> friction;
  Column<double, 5> pair_friction;
  Column<double, 2> pair_solreffriction;
  Column<double, 5> o_friction;
  Column<double, 2> o_solref;
  Column<double, 5> o_solimp;
  std::optional<Column<double, 6>> surfacevel;  // from MuJoCo 4 on
};

// MuJoCo combines these of two geoms, or takes from the <pair> that they are. Members have the names of
// mjContact's.
struct Parameters {
  std::int32_t dim = 0;
  double friction[5] = {}, solref[2] = {}, solreffriction[2] = {}, solimp[5] = {};
  double includemargin = 0, gap = 0, adhesion = 0;
};

template <typename Value, std::size_t size>
void copy(const Value (&from)[size], Value (&to)[size]) {
  std::copy(from, from + size, to);
}

// Returns what the first of two geoms counts, as mj_contactParam() decides.
double share_of_first(const Model& model, std::size_t i, std::size_t j) {
  const int first = model.priority[i][0], second = model.priority[j][0];
  if (first != second) return first > second ? 1 : 0;
  const double a = model.solmix[i][0], b = model.solmix[j][0];
  if (a >= kLeastMix && b >= kLeastMix) return a / (a + b);
  return a < kLeastMix && b < kLeastMix ? 0.5 : a < kLeastMix ? 0 : 1;
}

Parameters combined(const Model& model, std::size_t i, std::size_t j) {
  const Properties& geom = model.geom;
  const double share = share_of_first(model, i, j);
  const int priority = model.priority[i][0] - model.priority[j][0];
  const auto mix = [&](const auto& u, const auto& v, auto& mixed) {
    for (std::size_t k = 0; k < std::size(mixed); ++k) mixed[k] = share * u[k] + (1 - share) * v[k];
  };
  const auto choose = [&](auto u, auto v, auto both) { return priority > 0 ? u : priority < 0 ? v : both; };
  Parameters made;
  made.dim = choose(geom.dim[i][0], geom.dim[j][0], std::max(geom.dim[i][0], geom.dim[j][0]));
  made.adhesion = choose(geom.adhesion[i][0], geom.adhesion[j][0], geom.adhesion[i][0] + geom.adhesion[j][0]);
  constexpr int kKind[5] = {0, 0, 1, 2, 2};  // sliding twice, turning, rolling twice
  for (int k = 0; k < 5; ++k) {
    const double u = model.friction[i][kKind[k]], v = model.friction[j][kKind[k]];
    made.friction[k] = choose(u, v, std::max(u, v));
  }
  if (priority != 0 || (geom.solref[i][0] > 0 && geom.solref[j][0] > 0)) {
    mix(geom.solref[i], geom.solref[j], made.solref);
  } else {
    for (int k = 0; k < 2; ++k) made.solref[k] = std::min(geom.solref[i][k], geom.solref[j][k]);
  }
  mix(geom.solimp[i], geom.solimp[j], made.solimp);
  made.includemargin = geom.margin[i][0] + geom.margin[j][0];
  made.gap = geom.gap[i][0] + geom.gap[j][0];
  return made;
}

Parameters of_pair(const Model& model, std::size_t pair) {
  const Properties& pairs = model.pair;
  Parameters made = {.dim = pairs.dim[pair][0],
                     .includemargin = pairs.margin[pair][0],
                     .gap = pairs.gap[pair][0],
                     .adhesion = pairs.adhesion[pair][0]};
  copy(model.pair_friction[pair], made.friction);
  copy(pairs.solref[pair], made.solref);
  copy(model.pair_solreffriction[pair], made.solreffriction);
  copy(pairs.solimp[pair], made.solimp);
  return made;
}

// This says where mjContact has its members, from its first one, `dist`, on, and how many bytes it has.
struct Layout {
  explicit Layout(const nb::dict& offsets) {
    const auto at = [&](const char* name) { return nb::cast<std::size_t>(offsets[name]); };
    dist = at("dist"), pos = at("pos"), frame = at("frame"), includemargin = at("includemargin");
    friction = at("friction"), solref = at("solref"), solreffriction = at("solreffriction");
    solimp = at("solimp"), adhesion = at("adhesion"), dim = at("dim"), geom1 = at("geom1");
    geom2 = at("geom2"), geom = at("geom"), flex = at("flex"), elem = at("elem"), vert = at("vert");
    exclude = at("exclude"), efc_address = at("efc_address"), size = at("size");
    if (offsets.contains("surfacevel")) surfacevel = at("surfacevel");
  }
  std::size_t dist, pos, frame, includemargin, friction, solref, solreffriction, solimp, adhesion, dim, geom1,
      geom2, geom, flex, elem, vert, exclude, efc_address, size;
  std::optional<std::size_t> surfacevel;
};

// An MjData's list of contacts, known by the member `dist` of each.
class ContactList {
 public:
  ContactList(nb::handle dist, std::size_t size) : size_(size) {
    if (PyObject_GetBuffer(dist.ptr(), &view_, PyBUF_STRIDES | PyBUF_WRITABLE) != 0) throw nb::python_error();
  }
  ~ContactList() { PyBuffer_Release(&view_); }
  ContactList(const ContactList&) = delete;
  ContactList& operator=(const ContactList&) = delete;
  std::byte* operator[](std::size_t contact) const {
    return static_cast<std::byte*>(view_.buf) + contact * size_;
  }
  std::size_t count() const { return static_cast<std::size_t>(view_.shape[0]); }

 private:
  const std::size_t size_;
  Py_buffer view_;
};

// Normal and two tangents, as mju_makeFrame() chooses them.
void make_frame(const double (&normal)[3], double (&frame)[9]) {
  const int axis = std::abs(normal[1]) < 0.5 ? 1 : 2;
  double tangent[3], length = 0;
  for (int k = 0; k < 3; ++k) {
    tangent[k] = (k == axis) - normal[axis] * normal[k];
    length += tangent[k] * tangent[k];
  }
  for (int k = 0; k < 3; ++k) {
    frame[k] = normal[k];
    frame[3 + k] = tangent[k] /= std::sqrt(length);
  }
  for (int k = 0; k < 3; ++k) {
    const int u = (k + 1) % 3, v = (k + 2) % 3;
    frame[6 + k] = normal[u] * tangent[v] - normal[v] * tangent[u];
  }
}

// A plane is a slab below it that reaches beyond the bodies which could touch it. There is an asset for each
// width, each four times that of the one before.
struct Plane {
  std::uint32_t body;
  std::vector<std::uint32_t> others;
};
struct Slabs {
  std::uint32_t first_asset, count;
  double least_half_width;
};

class MujocoContacts {
 public:
  // geom, radius: of each body, which stand in the order of the types of their geoms. explicit_pairs: triples
  // of bodies a < b and their row among the <pair>s, sorted. plane_pairs: bodies, the plane first, sorted.
  MujocoContacts(nb::list assets, nb::handle asset, nb::handle pairs, nb::object filter,
                 std::uint32_t threads, std::uint32_t most_points, nb::object model, nb::handle geom,
                 nb::handle radius, nb::handle explicit_pairs, nb::handle plane_pairs, nb::tuple slabs,
                 nb::dict layout)
      : touches_(assets, asset, pairs, filter, threads, most_points),
        model_(model),
        geom_(copy_rows<std::uint32_t>(geom)),
        radius_(copy_rows<double>(radius)),
        explicit_(copy_rows<Explicit>(explicit_pairs)),
        slabs_{nb::cast<std::uint32_t>(slabs[0]), nb::cast<std::uint32_t>(slabs[1]),
               nb::cast<double>(slabs[2])},
        layout_(layout),
        is_ours_(model_.type.count()) {
    for (const std::uint32_t place : geom_) is_ours_[place] = true;
    for (const auto [plane, other] : copy_rows<tandem_object_pair>(plane_pairs)) {
      if (planes_.empty() || planes_.back().body != plane) planes_.push_back({plane, {}});
      planes_.back().others.push_back(other);
    }
  }

  // Finds the contacts of geoms that stand so; returns how many they are. override_margin: or None.
  std::size_t find(nb::handle places, nb::handle rotations, nb::handle override_margin) {
    const Turn turn(busy_, "another thread is in a call of these contacts");
    const Bytes place(places), rotation(rotations);
    if (place.size() != model_.type.count() * sizeof *place_ ||
        rotation.size() != model_.type.count() * sizeof *rotation_)
      throw nb::value_error("the data are not the model's: they have another number of geoms");
    place_ = static_cast<const double(*)[3]>(place.data());
    rotation_ = static_cast<const double(*)[3][3]>(rotation.data());
    is_overridden_ = !override_margin.is_none();
    override_margin_ = is_overridden_ ? nb::cast<double>(override_margin) : 0;
    const double largest = largest_reach();
    pose_bodies(largest);
    touches_.find(
        [this](std::uint32_t a, std::uint32_t b) {
          const Parameters of_both = parameters(a, b);
          return of_both.includemargin + of_both.gap;
        },
        largest);
    rows_.clear();
    on_planes_.clear();
    for (const Touch& touch : touches_.rows()) add_row(touch);
    std::sort(on_planes_.begin(), on_planes_.end());
    return rows_.size();
  }

  // Takes the contacts of the bodies' hulls out of MuJoCo's; returns how many are left, which come first.
  std::size_t drop_hulls(nb::handle dist) {
    const ContactList contacts(dist, layout_.size);
    std::size_t kept = 0;
    for (std::size_t contact = 0; contact < contacts.count(); ++contact) {
      std::int32_t geom[2];
      std::memcpy(geom, contacts[contact] + layout_.geom, sizeof geom);
      if (is_replaced(geom)) continue;
      if (kept != contact) std::memcpy(contacts[kept], contacts[contact], layout_.size);
      ++kept;
    }
    return kept;
  }

  // Writes the contacts that find() found over the last of MuJoCo's.
  void write(nb::handle dist) const {
    const ContactList contacts(dist, layout_.size);
    if (contacts.count() < rows_.size()) throw_broken_rows();
    for (std::size_t row = 0; row < rows_.size(); ++row)
      write_row(rows_[row], contacts[contacts.count() - rows_.size() + row]);
  }

  nb::object instances() const { return to_python(touches_.bodies().data(), touches_.bodies().size()); }

 private:
  struct Explicit {
    std::uint32_t a, b, row;
  };
  struct Row {
    std::int32_t geom[2];
    double dist, pos[3] = {}, frame[9] = {}, surfacevel[3] = {};
    Parameters parameters = {};
  };

  const std::uint32_t* explicit_row(std::uint32_t a, std::uint32_t b) const {
    const auto before = [](const Explicit& one, std::pair<std::uint32_t, std::uint32_t> other) {
      return std::pair(one.a, one.b) < other;
    };
    const auto found = std::lower_bound(explicit_.begin(), explicit_.end(), std::pair(a, b), before);
    return found != explicit_.end() && found->a == a && found->b == b ? &found->row : nullptr;
  }

  Parameters parameters(std::uint32_t a, std::uint32_t b) const {
    const std::uint32_t* const row = explicit_row(a, b);
    Parameters made = row != nullptr ? of_pair(model_, *row) : combined(model_, geom_[a], geom_[b]);
    if (is_overridden_) {
      copy(model_.o_friction[0], made.friction);
      copy(model_.o_solref[0], made.solref);
      copy(model_.o_solref[0], made.solreffriction);
      copy(model_.o_solimp[0], made.solimp);
      made.includemargin = override_margin_;
    }
    for (double& friction : made.friction) friction = std::max(friction, kLeastFriction);
    return made;
  }

  // The largest sum of margin and gap that any two bodies may have, 0 at least.
  double largest_reach() const {
    double largest = 0;
    const auto look = [&](const Properties& of, std::size_t row, int geoms) {
      const double margin = is_overridden_ ? override_margin_ : geoms * of.margin[row][0];
      largest = std::max(largest, margin + geoms * of.gap[row][0]);
    };
    for (const std::uint32_t geom : geom_) look(model_.geom, geom, 2);
    for (const Explicit& pair : explicit_) look(model_.pair, pair.row, 1);
    return largest;
  }

  void pose_bodies(double reach) {
    auto& bodies = touches_.bodies();
    for (std::size_t body = 0; body < bodies.size(); ++body) {
      std::memcpy(bodies[body].pose.rotation, rotation_[geom_[body]], sizeof bodies[body].pose.rotation);
      std::memcpy(bodies[body].pose.translation, place_[geom_[body]], sizeof bodies[body].pose.translation);
    }
    for (const Plane& plane : planes_) pose_slab(plane, reach);
  }

  // Bodies that are wholly above the plane, out of reach, or wholly below it cannot touch its surface. The
  // sphere about each of the others lies within the slab's sides, because the middle of the slab is moved by
  // at most a quarter of its half width. So the slab stands still while bodies move a little. It is thicker
  // than any such sphere reaches below the plane.
  void pose_slab(const Plane& plane, double reach) {
    auto& bodies = touches_.bodies();
    tandem_instance& slab = bodies[plane.body];
    const auto& axes = slab.pose.rotation;
    double lower[2] = {HUGE_VAL, HUGE_VAL}, upper[2] = {-HUGE_VAL, -HUGE_VAL};
    for (const std::uint32_t other : plane.others) {
      double local[3] = {};
      for (int i = 0; i < 3; ++i)
        for (int j = 0; j < 3; ++j)
          local[i] += axes[j][i] * (bodies[other].pose.translation[j] - slab.pose.translation[j]);
      const double radius = radius_[other];
      if (local[2] > radius + reach || local[2] < -radius) continue;
      for (int i = 0; i < 2; ++i) {
        lower[i] = std::min(lower[i], local[i] - radius);
        upper[i] = std::max(upper[i], local[i] + radius);
      }
    }
    slab.asset = slabs_.first_asset;
    if (!(lower[0] <= upper[0])) return;
    const double half_extent = 0.5 * std::max(upper[0] - lower[0], upper[1] - lower[1]);
    double half_width = slabs_.least_half_width;
    for (std::uint32_t k = 1; k < slabs_.count && 0.75 * half_width < half_extent; ++k) {
      half_width *= 4;
      ++slab.asset;
    }
    for (int i = 0; i < 2; ++i) {
      const double step = 0.5 * half_width, middle = 0.5 * (lower[i] + upper[i]);
      const double way = step * std::round(middle / step);
      for (int j = 0; j < 3; ++j) slab.pose.translation[j] += axes[j][i] * way;
    }
  }

  bool is_mesh(std::int32_t geom) const { return model_.type[geom][0] == kMesh; }

  // A plane has no hollows, so that MuJoCo's contact of a hull with it is right where Tandem finds none:
  // where the whole mesh is below.
  bool is_replaced(const std::int32_t (&geom)[2]) const {
    if (geom[0] < 0 || geom[1] < 0 || !is_ours_[geom[0]] || !is_ours_[geom[1]]) return false;
    if (!is_mesh(geom[0]) && !is_mesh(geom[1])) return false;
    if (model_.type[geom[0]][0] != kPlane) return true;
    return std::binary_search(on_planes_.begin(), on_planes_.end(), std::pair(geom[0], geom[1]));
  }

  void add_row(const Touch& touch) {
    Row row{.geom = {static_cast<std::int32_t>(geom_[touch.a]), static_cast<std::int32_t>(geom_[touch.b])},
            .dist = touch.gap};
    row.parameters = parameters(touch.a, touch.b);
    if (!(touch.gap <= row.parameters.includemargin + row.parameters.gap)) return;
    copy(touch.position, row.pos);
    make_frame(touch.normal, row.frame);
    if (model_.surfacevel) set_surface_velocity(row);
    rows_.push_back(row);
    if (model_.type[row.geom[0]][0] == kPlane) on_planes_.emplace_back(row.geom[0], row.geom[1]);
  }

  // The velocity of the second geom's surface against the first's, along both tangents, and about the normal.
  void set_surface_velocity(Row& row) const {
    double linear[3] = {}, spin[3] = {};
    for (int side = 0; side < 2; ++side) {
      const std::int32_t geom = row.geom[side];
      const auto& of_surface = (*model_.surfacevel)[geom];
      const auto& axes = rotation_[geom];
      double way[3], turn[3];
      for (int i = 0; i < 3; ++i) {
        way[i] = row.pos[i] - place_[geom][i];
        turn[i] = 0;
        for (int j = 0; j < 3; ++j) turn[i] += axes[i][j] * of_surface[3 + j];
      }
      for (int i = 0; i < 3; ++i) {
        const int u = (i + 1) % 3, v = (i + 2) % 3;
        double along = turn[u] * way[v] - turn[v] * way[u];
        for (int j = 0; j < 3; ++j) along += axes[i][j] * of_surface[j];
        linear[i] += side == 0 ? -along : along;
        spin[i] += side == 0 ? -turn[i] : turn[i];
      }
    }
    for (int i = 0; i < 3; ++i) {
      row.surfacevel[0] += row.frame[3 + i] * linear[i];
      row.surfacevel[1] += row.frame[6 + i] * linear[i];
      row.surfacevel[2] += row.frame[i] * spin[i];
    }
  }

  void write_row(const Row& row, std::byte* contact) const {
    const auto put = [&](std::size_t offset, const auto& value) {
      std::memcpy(contact + offset, &value, sizeof value);
    };
    const Parameters& of = row.parameters;
    std::memset(contact, 0, layout_.size);
    put(layout_.dist, row.dist);
    put(layout_.pos, row.pos);
    put(layout_.frame, row.frame);
    put(layout_.includemargin, of.includemargin);
    put(layout_.friction, of.friction);
    put(layout_.solref, of.solref);
    put(layout_.solreffriction, of.solreffriction);
    put(layout_.solimp, of.solimp);
    put(layout_.adhesion, of.adhesion);
    put(layout_.dim, of.dim);
    put(layout_.geom1, row.geom[0]);
    put(layout_.geom2, row.geom[1]);
    put(layout_.geom, row.geom);
    put(layout_.exclude, std::int32_t{row.dist >= of.includemargin});  // in the gap
    constexpr std::int32_t kNone[2] = {-1, -1};
    for (const std::size_t offset : {layout_.flex, layout_.elem, layout_.vert}) put(offset, kNone);
    put(layout_.efc_address, kNone[0]);
    if (layout_.surfacevel) put(*layout_.surfacevel, row.surfacevel);
  }

  Touches touches_;
  const Model model_;
  const std::vector<std::uint32_t> geom_;
  const std::vector<double> radius_;
  const std::vector<Explicit> explicit_;
  const Slabs slabs_;
  const Layout layout_;
  std::vector<bool> is_ours_;
  std::vector<Plane> planes_;
  std::atomic<bool> busy_ = false;
  // These are of the last call.
  const double (*place_)[3] = nullptr;
  const double (*rotation_)[3][3] = nullptr;
  bool is_overridden_ = false;
  double override_margin_ = 0;
  std::vector<Row> rows_;
  std::vector<std::pair<std::int32_t, std::int32_t>> on_planes_;  // geoms of rows, the plane first; sorted
};

}  // namespace

void add_mujoco(nb::module_& module) {
  nb::class_<MujocoContacts>(module, "MujocoContacts")
      .def(nb::init<nb::list, nb::handle, nb::handle, nb::object, std::uint32_t, std::uint32_t, nb::object,
                    nb::handle, nb::handle, nb::handle, nb::handle, nb::tuple, nb::dict>(),
           nb::arg(), nb::arg(), nb::arg().none(), nb::arg().none(), nb::arg(), nb::arg(), nb::arg(),
           nb::arg(), nb::arg(), nb::arg(), nb::arg(), nb::arg(), nb::arg())
      .def("find", &MujocoContacts::find, nb::arg(), nb::arg(), nb::arg().none())
      .def("drop_hulls", &MujocoContacts::drop_hulls)
      .def("write", &MujocoContacts::write)
      .def("instances", &MujocoContacts::instances);
}

}  // namespace tandem::python
