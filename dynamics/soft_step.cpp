#include <algorithm>
#include <cmath>

#include "dynamics/island_joints.h"
#include "dynamics/joint_visit.h"

namespace tandem::dynamics {
namespace {

Softness softness(double frequency, double damping_ratio, double h) {
  const double omega = 2 * kPi * frequency;
  const double a1 = 2 * damping_ratio + h * omega, a2 = h * omega * a1;
  return {omega / a1, a2 / (1 + a2), 1 / (1 + a2)};
}

class SoftStep {
 public:
  SoftStep(IslandProblem& problem, const StepInput& input, const SolverOptions& options)
      : p_(problem),
        input_(input),
        contacts_(input.contacts),
        slop_(options.slop),
        friction_(options.friction),
        rolling_resistance_(options.rolling_resistance),
        substeps_(options.substeps),
        h_(input.dt / options.substeps),
        between_movers_(softness(1 / (8 * h_), 10, h_)),
        against_unmoved_(softness(2 / (8 * h_), 5, h_)),
        joints_(softness(2 / (8 * h_), 5, h_)) {}

  void solve() {
    constexpr int kRelaxingSweeps = 2;
    const std::size_t bodies = p_.bodies.size(), contacts = p_.contact_count();
    prepare();
    find_opposed();
    std::vector<Vector6> start(bodies);
    for (std::uint32_t k = 0; k < substeps_; ++k) {
      for (std::size_t j = 1; j < bodies; ++j) {
        start[j] = p_.velocity[j] + h_ * p_.gravity[j];
        p_.velocity[j] = start[j] + pushed_[j];
      }
      for (const JointBlock& joint : blocks_) visit_joint(joint, p_.joint_rows, p_.velocity, h_, &joints_);
      for (std::size_t i = 0; i < contacts; ++i) visit_soft(i);
      for (std::size_t j = 1; j < bodies; ++j) p_.displacement[j] += h_ * p_.velocity[j];
      follow_joints((k + 1) * h_);
      for (int sweep = 0; sweep < kRelaxingSweeps; ++sweep) {
        for (const JointBlock& joint : blocks_) visit_joint(joint, p_.joint_rows, p_.velocity, h_, nullptr);
        for (std::size_t i = 0; i < contacts; ++i) relax(i, (k + 1) * h_);
      }
      for (std::size_t i = 0; i < contacts; ++i) visit_friction(i);
      for (TouchingPair& pair : p_.pairs) visit_turning(pair);
      for (std::size_t j = 1; j < bodies; ++j) pushed_[j] = p_.velocity[j] - start[j];
      // The next substep starts with the impulses of joints as its own rows have them.
      for (std::size_t j = 1; j < turned_.size(); ++j) pushed_[j] += turned_[j];
    }
    constexpr int kRestitutionSweeps = 10;
    for (int k = 0; k < kRestitutionSweeps; ++k) {
      for (std::size_t i = 0; i < contacts; ++i) restitute(i);
    }
    for (Vector3& impulse : p_.impulse) impulse = substeps_ * impulse;
    for (TouchingPair& pair : p_.pairs) pair.impulse = substeps_ * pair.impulse;
    for (JointRow& row : p_.joint_rows) row.impulse = substeps_ * row.impulse;
  }

  // Condition: solve() was called.
  Residual residual() const {
    std::vector<double> target(p_.contact_count());
    for (std::size_t i = 0; i < target.size(); ++i) {
      target[i] = is_rebound(i) ? p_.rebound[i] : -std::max(0.0, followed_[i]) / h_;
    }
    return residual_of(p_, target, friction_, 1.0 / substeps_);
  }

 private:
  void prepare() {
    const std::size_t contacts = p_.contact_count();
    normal_mass_.resize(contacts), friction_mass_.resize(contacts);
    followed_ = p_.separation;
    strongest_.assign(contacts, 0);
    pushed_.assign(p_.bodies.size(), Vector6{});
    for (std::size_t i = 0; i < contacts; ++i) {
      normal_mass_[i] = 1 / p_.normal[i].mobility();
      friction_mass_[i] = 1 / p_.friction_mobility(i);
      p_.impulse[i] = p_.impulse[i] / substeps_;
      pushed_[p_.a[i]] += p_.change_of_a(i, p_.impulse[i]);
      pushed_[p_.b[i]] += p_.change_of_b(i, p_.impulse[i]);
    }
    for (TouchingPair& pair : p_.pairs) {
      pair.impulse = pair.impulse / substeps_;
      pushed_[p_.a[pair.begin]] += pair.change_of_a(pair.impulse);
      pushed_[p_.b[pair.begin]] += pair.change_of_b(pair.impulse);
    }
    blocks_ = joint_blocks(p_.joint_rows);
    for (JointRow& row : p_.joint_rows) {
      for (double* of_step : {&row.impulse, &row.least_push, &row.most_push}) *of_step /= substeps_;
      pushed_[row.a] += row.impulse * row.gradient.a;
      pushed_[row.b] += row.impulse * row.gradient.b;
    }
  }

  // Bodies that impact has driven into each other may be held from both sides: what pushes one way makes the
  // other deeper, the pushes are hundreds of times their weight, and whichever point is found next throws
  // them about. So a deep contact pushes for what it is deeper than the same pair's contacts that push
  // against it.
  void find_opposed() {
    constexpr double kDeep = 4;  // slops
    const double deep = kDeep * slop_;
    opposed_.assign(p_.contact_count(), 0);
    for (const TouchingPair& pair : p_.pairs) {
      for (std::uint32_t i = pair.begin; i < pair.end; ++i) {
        if (p_.separation[i] > -deep) continue;
        const Vector3& normal = contacts_[p_.contacts[i]].normal;
        double opposed = 0;
        for (std::uint32_t j = pair.begin; j < pair.end; ++j) {
          const double along = dot(normal, contacts_[p_.contacts[j]].normal);
          opposed = std::max(opposed, std::min(along, 0.0) * std::min(p_.separation[j], 0.0));
        }
        opposed_[i] = std::min(opposed, -deep - p_.separation[i]);
      }
    }
  }

  void follow_joints(double time) {
    if (blocks_.empty()) return;
    turned_.assign(p_.bodies.size(), Vector6{});
    add_impulses(-1);
    dynamics::follow_joints(p_, input_, p_.displacement, time, p_.joint_rows);
    for (JointBlock& joint : blocks_) factorise(joint, p_.joint_rows);
    add_impulses(1);
  }

  void add_impulses(double sign) {
    for (const JointRow& row : p_.joint_rows) {
      turned_[row.a] += sign * row.impulse * row.gradient.a;
      turned_[row.b] += sign * row.impulse * row.gradient.b;
    }
  }

  void add(const ContactRow& row, std::size_t i, double impulse) {
    // A body that is not moved has a gradient of zero, so that place 0 stays 0.
    p_.velocity[p_.a[i]] += impulse * row.a;
    p_.velocity[p_.b[i]] += impulse * row.b;
  }

  void visit_normal(std::size_t i, double bias, double mass_scale, double impulse_scale) {
    const ContactRow& row = p_.normal[i];
    const double w = p_.along(row, i, p_.velocity) + p_.drive[i].x;
    double& impulse = p_.impulse[i].x;
    const double wanted = impulse - normal_mass_[i] * mass_scale * (w + bias) - impulse_scale * impulse;
    const double next = std::max(0.0, wanted);
    add(row, i, next - impulse);
    impulse = next;
    strongest_[i] = std::max(strongest_[i], next);
  }

  void visit_soft(std::size_t i) {
    constexpr double kFastestPush = 3;  // m/s
    if (followed_[i] > 0) return visit_normal(i, followed_[i] / h_, 1, 0);
    const double s = std::min(0.0, followed_[i] + opposed_[i]);
    const Softness& soft = p_.a[i] == 0 || p_.b[i] == 0 ? against_unmoved_ : between_movers_;
    visit_normal(i, std::max(soft.bias_rate * s, -kFastestPush), soft.mass_scale, soft.impulse_scale);
  }

  void relax(std::size_t i, double time) {
    const double s = p_.separation[i] + p_.along(p_.normal[i], i, p_.displacement) + time * p_.drive[i].x;
    followed_[i] = s;
    visit_normal(i, std::max(0.0, s / h_), 1, 0);
  }

  void visit_friction(std::size_t i) {
    Vector3& impulse = p_.impulse[i];
    const double bound = friction_ * impulse.x;
    const double w1 = p_.along(p_.first[i], i, p_.velocity) + p_.drive[i].y;
    const double w2 = p_.along(p_.second[i], i, p_.velocity) + p_.drive[i].z;
    double next1 = impulse.y - friction_mass_[i] * w1, next2 = impulse.z - friction_mass_[i] * w2;
    const double size = std::sqrt(next1 * next1 + next2 * next2);
    if (size > bound) next1 *= bound / size, next2 *= bound / size;
    const double change1 = next1 - impulse.y, change2 = next2 - impulse.z;
    p_.velocity[p_.a[i]] += change1 * p_.first[i].a + change2 * p_.second[i].a;
    p_.velocity[p_.b[i]] += change1 * p_.first[i].b + change2 * p_.second[i].b;
    impulse.y = next1, impulse.z = next2;
  }

  void visit_turning(TouchingPair& pair) {
    double push = 0;
    for (std::uint32_t contact = pair.begin; contact < pair.end; ++contact) push += p_.impulse[contact].x;
    const double bound = rolling_resistance_ * push;
    const Vector3 turning = p_.turning(pair, p_.velocity) + pair.drive;
    Vector3 next = pair.impulse - turning / pair.mobility;
    const double size = norm(next);
    if (size > bound) next = (bound / size) * next;
    const Vector3 change = next - pair.impulse;
    p_.velocity[p_.a[pair.begin]] += pair.change_of_a(change);
    p_.velocity[p_.b[pair.begin]] += pair.change_of_b(change);
    pair.impulse = next;
  }

  bool is_rebound(std::size_t i) const { return p_.rebound[i] > 0 && strongest_[i] > 0; }

  void restitute(std::size_t i) {
    if (is_rebound(i)) visit_normal(i, -p_.rebound[i], 1, 0);
  }

  IslandProblem& p_;
  const StepInput& input_;
  std::span<const ContactPoint> contacts_;
  double slop_;
  double friction_, rolling_resistance_;
  std::uint32_t substeps_;
  double h_;
  Softness between_movers_, against_unmoved_, joints_;
  std::vector<JointBlock> blocks_;
  std::vector<Vector6> turned_;  // what joints' impulses would give more had their rows been those of the end
  std::vector<double> normal_mass_, friction_mass_;
  std::vector<double> followed_;   // separations as they change
  std::vector<double> opposed_;    // by how much depth the push is less
  std::vector<double> strongest_;  // largest impulse along the normal
  std::vector<Vector6> pushed_;    // what the contacts of a substep have added to the velocities
};

}  // namespace

Residual solve_soft_step(IslandProblem& problem, const StepInput& input, const SolverOptions& options) {
  SoftStep step(problem, input, options);
  step.solve();
  return step.residual();
}

}  // namespace tandem::dynamics
