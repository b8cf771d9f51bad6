#include "contact_finder.h"

#include <chrono>

namespace tandem::simulation {
namespace {

class MeshContactFinder : public ContactFinder {
 public:
  MeshContactFinder(std::unique_ptr<Engine> engine, std::span<const AssetView> shapes,
                    const ContactPointOptions& options)
      : engine_(std::move(engine)), options_(options) {
    engine_->set_shapes(shapes);
    generator_.set_shapes(shapes);
  }

  const std::vector<ContactPoint>& find(std::span<const BodyPose> bodies, std::span<const std::uint8_t> idle,
                                        std::span<const BodyPair> unmoved) override {
    engine_->find(bodies, idle, found_);
    const auto start = std::chrono::steady_clock::now();
    const std::vector<ContactPoint>& points = generator_.generate(found_, bodies, unmoved, options_);
    const std::chrono::duration<double> taken = std::chrono::steady_clock::now() - start;
    report_ = {engine_->times(), taken.count(), engine_->counters(), generator_.statistics()};
    return points;
  }

 private:
  std::unique_ptr<Engine> engine_;
  ContactGenerator generator_;
  ContactPointOptions options_;
  ContactList found_;
};

}  // namespace

std::unique_ptr<ContactFinder> make_mesh_contact_finder(std::unique_ptr<Engine> engine,
                                                        std::span<const AssetView> shapes,
                                                        const ContactPointOptions& options) {
  return std::make_unique<MeshContactFinder>(std::move(engine), shapes, options);
}

}  // namespace tandem::simulation
