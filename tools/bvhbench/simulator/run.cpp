#include "run.h"

#include <unistd.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <csignal>
#include <cstdio>
#include <filesystem>

#include "bvhbench/scenes/hdf5_file.h"
#include "bvhbench/scenes/make_scene.h"

namespace tandem::simulation {
namespace {

bool is_free(const BodyMover& mover, std::uint32_t body, const Vector3& position) {
  const auto bodies = mover.bodies();
  const auto states = mover.states();
  for (std::uint32_t i = 0; i < bodies.size(); ++i) {
    if (i == body || bodies[i].motion != Motion::moving) continue;
    const double reach = bodies[i].radius + bodies[body].radius;
    if (square(states[i].position - position) < reach * reach) return false;
  }
  return true;
}

using Clock = std::chrono::steady_clock;

double seconds_between(Clock::time_point start, Clock::time_point end) {
  return std::chrono::duration<double>(end - start).count();
}

volatile std::sig_atomic_t g_signal = 0;

void take_note(int signal) {
  g_signal = signal;
}

// While it lives, signals that ask a process to end are noted.
class SignalNotes {
 public:
  SignalNotes() {
    struct sigaction action {};
    action.sa_handler = take_note;
    g_signal = 0;
    for (std::size_t i = 0; i < kSignals.size(); ++i) {
      ::sigaction(kSignals[i], nullptr, &previous_[i]);
      if (previous_[i].sa_handler != SIG_IGN) ::sigaction(kSignals[i], &action, nullptr);
    }
  }
  ~SignalNotes() {
    for (std::size_t i = 0; i < kSignals.size(); ++i) ::sigaction(kSignals[i], &previous_[i], nullptr);
  }
  SignalNotes(const SignalNotes&) = delete;
  SignalNotes& operator=(const SignalNotes&) = delete;

  bool any() const { return g_signal != 0; }

  // Lets the signal do what it does to programs that take no note of it.
  [[noreturn]] void obey() const {
    const int signal = g_signal;
    ::signal(signal, SIG_DFL);
    ::raise(signal);
    std::abort();
  }

 private:
  static constexpr std::array<int, 3> kSignals = {SIGINT, SIGTERM, SIGHUP};
  std::array<struct sigaction, kSignals.size()> previous_{};
};

// A line on a terminal.
class ProgressLine {
 public:
  ProgressLine(std::string what, std::uint32_t steps) : what_(std::move(what)), steps_(steps) {}
  ~ProgressLine() { clear(); }

  void show(std::size_t made, const StepRecord& record) {
    constexpr double kInterval = 0.2;
    const Clock::time_point now = Clock::now();
    if (first_ == 0) first_ = made;
    if (!terminal_ || seconds_between(shown_, now) < kInterval) return;
    shown_ = now;
    const double each = seconds_between(start_, now) / static_cast<double>(made - first_ + 1);
    std::fprintf(stderr,
                 "\r\x1b[K%s: step %zu of %u, %.1f ms each, %.0f s left; %llu triangle pairs, %llu contacts, "
                 "fastest %.3g m/s",
                 what_.c_str(), made, steps_, 1e3 * each, each * static_cast<double>(steps_ - made),
                 static_cast<unsigned long long>(record.triangle_pairs),
                 static_cast<unsigned long long>(record.contacts), record.speed_max);
    std::fflush(stderr);
  }
  void clear() {
    if (terminal_) std::fputs("\r\x1b[K", stderr);
  }

 private:
  bool terminal_ = ::isatty(STDERR_FILENO) == 1;
  std::string what_;
  std::uint32_t steps_;
  std::size_t first_ = 0;
  Clock::time_point start_ = Clock::now(), shown_ = start_;
};

// Decides when to write next: writing takes at most a twentieth of the time.
class Checkpoints {
 public:
  explicit Checkpoints(double interval) : interval_(interval) {}

  bool is_due() const { return seconds_between(last_, Clock::now()) >= std::max(interval_, 20 * cost_); }

  template <typename Write>
  void write(const Write& write) {
    const Clock::time_point start = Clock::now();
    write();
    last_ = Clock::now();
    cost_ = seconds_between(start, last_);
  }

 private:
  double interval_, cost_ = 0;
  Clock::time_point last_ = Clock::now();
};

// Refuses a state that no further step can start from, such as that of a body whose speed has overflowed.
void check_states(const BodyMover& mover, const std::string& output, std::uint32_t step) {
  const auto states = mover.states();
  const auto lost = std::find_if_not(states.begin(), states.end(), is_usable);
  if (lost == states.end()) return;
  throw bench::FileError(output + ": step " + std::to_string(step) + ": body " +
                         std::to_string(lost - states.begin()) +
                         ": its place or velocity is no longer a finite number of at most 1e300");
}

// Makes a step. What an engine refuses is told by the step and the body.
StepRecord make_step(BodyMover& mover, const std::string& output, std::uint32_t step) {
  try {
    StepRecord record = mover.step();
    check_states(mover, output, step);
    return record;
  } catch (const EngineError& error) {
    throw bench::FileError(output + ": step " + std::to_string(step) + ": " + error.what());
  } catch (const QueryFailed& failed) {
    const std::string body =
        subject(failed.status) != nullptr ? "body " + std::to_string(failed.where) + ": " : "";
    throw bench::FileError(output + ": step " + std::to_string(step) + ": " + body + explain(failed.status));
  }
}

RunResults start(BodyMover& mover, const RunDescription& run, const RunOptions& options) {
  const std::string part = part_file(options.output);
  RunResults results;
  if (options.resume && std::filesystem::exists(part)) {
    results = read_run(part, run);
    mover.restore(results.state);
  } else {
    results.trajectory.every = options.trajectory_every;
    results.trajectory.keep(0, mover.states());
  }
  results.trajectory.every = options.trajectory_every;
  return results;
}

}  // namespace

Reentry::Reentry(const AssetView& sheet, std::span<const Instance> grounds, double tilt, std::uint64_t seed)
    : lower_{HUGE_VAL, HUGE_VAL, HUGE_VAL}, upper_(-lower_), seed_(seed) {
  const double angle = tilt * M_PI / 180;
  frame_ = matrix_of(rotation_by({0, angle, 0}));
  const Bounds bounds = bounds_of(sheet);
  for (const Instance& ground : grounds) {
    for (int corner = 0; corner < 8; ++corner) {
      double world[3];
      const auto end = [&](int k) { return corner >> k & 1 ? bounds.upper[k] : bounds.lower[k]; };
      tandem::apply(ground.pose, end(0), end(1), end(2), world);
      const Vector3 seen = transposed(frame_) * vector_of(world);
      lower_ = {std::min(lower_.x, seen.x), std::min(lower_.y, seen.y), std::min(lower_.z, seen.z)};
      upper_ = {std::max(upper_.x, seen.x), std::max(upper_.y, seen.y), std::max(upper_.z, seen.z)};
    }
  }
}

bool Reentry::has_left(const Vector3& position, double radius) const {
  const Vector3 seen = transposed(frame_) * position;
  const bool beside = seen.x > upper_.x || seen.x < lower_.x || seen.y > upper_.y || seen.y < lower_.y;
  return beside || seen.z < lower_.z - radius;
}

BodyState Reentry::entry(const BodyMover& mover, std::uint32_t body, std::uint64_t step) const {
  constexpr int kTriesAtAHeight = 30;
  const double radius = mover.bodies()[body].radius;
  Random random(seed_ * 0x9E3779B97F4A7C15u + step * 0xC2B2AE3D27D4EB4Fu + body);
  BodyState state;
  const Rotation turned = random_rotation(random);
  double rotation[3][3];
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) rotation[i][j] = turned[i][j];
  }
  state.orientation = quaternion_of(rotation);
  for (double height = upper_.z + radius;; height += radius) {
    for (int i = 0; i < kTriesAtAHeight; ++i) {
      const double along = lower_.x + random.between(radius, 3 * radius);
      const double across = random.between(lower_.y + radius, upper_.y - radius);
      state.position = frame_ * Vector3{along, across, height};
      if (is_free(mover, body, state.position)) return state;
    }
  }
}

std::uint64_t Reentry::apply(BodyMover& mover, std::uint64_t step) const {
  std::uint64_t count = 0;
  for (std::uint32_t i = 0; i < mover.bodies().size(); ++i) {
    const BodyProperties& body = mover.bodies()[i];
    if (body.motion != Motion::moving || !has_left(mover.states()[i].position, body.radius)) continue;
    mover.place(i, entry(mover, i, step));
    ++count;
  }
  return count;
}

std::string part_file(const std::string& output) {
  return output + ".part";
}

RunResults run_simulation(BodyMover& mover, const RunDescription& run, const std::optional<Reentry>& reentry,
                          const RunOptions& options) {
  RunResults results = start(mover, run, options);
  const SignalNotes signals;
  const std::string part = part_file(options.output);
  ProgressLine progress(options.output, options.steps);
  Checkpoints checkpoints(options.checkpoint_seconds);
  const auto write = [&](const std::string& path) {
    results.state = mover.save();
    write_run(path, run, results);
  };
  while (results.records.size() < options.steps) {
    const auto made = static_cast<std::uint32_t>(results.records.size() + 1);
    StepRecord record = make_step(mover, options.output, made);
    if (run.triangles > 0) {
      record.contact_ratio = static_cast<double>(record.triangle_pairs) / static_cast<double>(run.triangles);
    }
    if (reentry) record.reentered = reentry->apply(mover, made);
    results.records.push_back(record);
    results.trajectory.keep(made, mover.states());
    progress.show(made, record);
    if (signals.any()) {
      write(part);
      progress.clear();
      std::fprintf(stderr, "bvhbench: %s: stopped after step %u of %u; --resume goes on\n", part.c_str(),
                   made, options.steps);
      signals.obey();
    }
    if (checkpoints.is_due()) checkpoints.write([&] { write(part); });
  }
  write(options.output);
  std::error_code none;  // there may be no part file
  std::filesystem::remove(part, none);
  return results;
}

}  // namespace tandem::simulation
