#pragma once
#include <algorithm>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "bodies.h"
#include "tandem/dynamics/world.h"

/// What worlds on the CPU and on a GPU are given in the same way. What makes a list throws std::bad_alloc.
namespace tandem::c {

/// Bodies as a world takes them.
struct GivenBodies {
  std::vector<BodyDescription> bodies;
  std::vector<ObjectPair> excluded;
  std::vector<JointDescription> joints;
};

/// Reads an option that a flag may say to be 0; it is left alone where it has its default. False: both say
/// something, or one says what it cannot.
inline bool read_option(uint32_t is_zero, double given, double& option) {
  if (is_zero > 1 || (is_zero == 1 && given != 0) || !(given >= 0)) return false;
  if (is_zero == 1 || given != 0) option = given;
  return true;
}

/// Reads a world's options. The world checks how large they are. Result: TANDEM_OK, TANDEM_BAD_STRUCT_SIZE
/// or TANDEM_BAD_OPTION.
inline tandem_status read_options(const tandem_world_options* given, WorldOptions& options) {
  tandem_world_options read;
  if (const tandem_status status = read_struct(given, read); status != TANDEM_OK) return status;
  const bool falls = std::ranges::any_of(read.gravity, [](double g) { return g != 0; });
  const bool good =
      read_option(read.no_friction, read.friction, options.friction) &&
      read_option(read.no_slop, read.slop, options.slop) &&
      read_option(read.no_rolling_resistance, read.rolling_resistance, options.rolling_resistance) &&
      read.no_gravity <= 1 && !(read.no_gravity == 1 && falls) && read.no_sleeping <= 1 &&
      read.continuous <= 1 && read.reserved == 0;
  if (!good) return TANDEM_BAD_OPTION;
  if (falls || read.no_gravity == 1) std::ranges::copy(read.gravity, options.gravity);
  options.restitution = read.restitution;
  if (read.substeps != 0) options.substeps = read.substeps;
  if (read.threads != 0) options.threads = read.threads;
  options.sleeping = read.no_sleeping == 0;
  options.continuous = read.continuous != 0;
  return TANDEM_OK;
}

/// Result: TANDEM_OK, TANDEM_BAD_STRUCT_SIZE, TANDEM_BAD_OPTION or TANDEM_MOTION_MISMATCH.
inline tandem_status read_start(const tandem_body_start* given, size_t bodies, tandem_body_start& read) {
  if (const tandem_status status = read_struct(given, read); status != TANDEM_OK) return status;
  if (read.reserved != 0) return TANDEM_BAD_OPTION;
  const double* const rows[] = {read.density,      read.velocity,    read.angular_velocity,
                                read.friction,     read.restitution, read.rolling_resistance,
                                read.gravity_scale};
  const bool has_rows = std::ranges::any_of(rows, [](const double* row) { return row != nullptr; });
  return has_rows && read.count != bodies ? TANDEM_MOTION_MISMATCH : TANDEM_OK;
}

/// The pairs of a filter in the order of its table. Result: TANDEM_OK or TANDEM_UNKNOWN_INSTANCE.
inline tandem_status read_excluded(const tandem_excluded_pairs* given, size_t bodies,
                                   std::vector<ObjectPair>& pairs, uint64_t& where) {
  if (given == nullptr) return TANDEM_OK;
  if (given->table.view().instances > bodies) {
    where = given->table.view().row;
    return TANDEM_UNKNOWN_INSTANCE;
  }
  for (const uint64_t key : given->table.slots()) {
    if (key != ExcludedPairs::kEmpty)
      pairs.push_back({static_cast<uint32_t>(key >> 32), static_cast<uint32_t>(key)});
  }
  return TANDEM_OK;
}

/// Result: TANDEM_OK or TANDEM_BAD_JOINT.
inline tandem_status read_joint(const tandem_joint& from, JointDescription& joint) {
  const bool is_limited = from.has_limits != 0 || from.least != 0 || from.most != 0;
  if (from.kind > TANDEM_DISTANCE || from.has_limits > 1 || from.may_touch > 1 ||
      (is_limited && from.has_limits == 0) || from.reserved[0] != 0 || from.reserved[1] != 0)
    return TANDEM_BAD_JOINT;
  joint.kind = static_cast<JointKind>(from.kind);
  joint.a = from.a, joint.b = from.b;
  std::ranges::copy(from.anchor, joint.anchor);
  std::ranges::copy(from.anchor_b, joint.anchor_b);
  std::ranges::copy(from.axis, joint.axis);
  if (from.has_limits != 0) joint.least = from.least, joint.most = from.most;
  joint.speed = from.speed, joint.most_effort = from.most_effort;
  if (from.breaking_force != 0) joint.breaking_force = from.breaking_force;
  if (from.breaking_torque != 0) joint.breaking_torque = from.breaking_torque;
  joint.may_touch = from.may_touch != 0;
  return TANDEM_OK;
}

/// Result: TANDEM_OK, TANDEM_NULL_ARGUMENT or, where `where` is the joint, TANDEM_BAD_JOINT.
inline tandem_status read_joints(const tandem_body_start& given, std::vector<JointDescription>& joints,
                                 uint64_t& where) {
  if (!is_there(given.joints, given.joint_count)) return TANDEM_NULL_ARGUMENT;
  for (size_t i = 0; i < given.joint_count; ++i) {
    if (const tandem_status status = read_joint(given.joints[i], joints.emplace_back());
        status != TANDEM_OK) {
      where = i;
      return status;
    }
  }
  return TANDEM_OK;
}

/// Describes body i, of a filter and starts that were read.
inline BodyDescription describe(const tandem_instance& instance, const tandem_pair_filter& filter,
                                const tandem_body_start& starts, size_t i) {
  BodyDescription body;
  body.asset = instance.asset;
  body.pose = std::bit_cast<Pose>(instance.pose);
  if (filter.motion != nullptr) body.filter.motion = static_cast<Motion>(filter.motion[i]);
  if (filter.group != nullptr) body.filter.group = filter.group[i];
  if (filter.mask != nullptr) body.filter.mask = filter.mask[i];
  if (filter.world != nullptr) body.filter.world = filter.world[i];
  const auto take = [i](const double* from, double& to) { to = from != nullptr ? from[i] : to; };
  take(starts.density, body.density);
  take(starts.friction, body.material.friction);
  take(starts.restitution, body.material.restitution);
  take(starts.rolling_resistance, body.material.rolling_resistance);
  take(starts.gravity_scale, body.gravity_scale);
  if (starts.velocity != nullptr) std::copy_n(starts.velocity + 3 * i, 3, body.velocity);
  if (starts.angular_velocity != nullptr)
    std::copy_n(starts.angular_velocity + 3 * i, 3, body.angular_velocity);
  return body;
}

/// Reads all that bodies are placed with. Result: TANDEM_OK, TANDEM_NULL_ARGUMENT, or as of read_filter(),
/// read_start(), read_excluded() and read_joints(); `where` is what is to blame.
inline tandem_status read_bodies(const tandem_instance* instances, size_t count,
                                 const tandem_pair_filter* filter, const tandem_body_start* start,
                                 GivenBodies& read, uint64_t& where) {
  if (!is_there(instances, count)) return TANDEM_NULL_ARGUMENT;
  tandem_pair_filter filters;
  tandem_body_start starts;
  tandem_status status = read_filter(filter, count, filters, where);
  if (status == TANDEM_OK) status = read_start(start, count, starts);
  if (status == TANDEM_OK) status = read_excluded(filters.excluded, count, read.excluded, where);
  if (status == TANDEM_OK) status = read_joints(starts, read.joints, where);
  if (status != TANDEM_OK) return status;
  read.bodies.reserve(count);
  for (size_t i = 0; i < count; ++i) read.bodies.push_back(describe(instances[i], filters, starts, i));
  return TANDEM_OK;
}

/// Reads a pose and velocities; `centre` and `sleeps` are not looked at.
inline BodyMotion read_motion(const tandem_body_motion& given) {
  BodyMotion motion = {};
  motion.pose = std::bit_cast<Pose>(given.pose);
  std::ranges::copy(given.velocity, motion.velocity);
  std::ranges::copy(given.angular_velocity, motion.angular_velocity);
  return motion;
}

}  // namespace tandem::c
