#include <memory>

#include "bvhbench/engines/gpu_engine.h"
#include "paper_engine.h"

namespace tandem {
namespace {

/// The paper's scheme, which asks the CPU after each level of the trees.
class PaperSchemeEngine final : public GpuEngine {
 public:
  PaperSchemeEngine(std::string_view name, bench::PaperFlags flags, QueryMode mode)
      : GpuEngine(name, Contents::all) {
    options_.mode = mode;
    options_.flags = flags;
  }

 private:
  void name_shapes() override {
    const Status status = query_.set_assets(shapes(), stream());
    check(status, query_.cuda_error(), "assets");
  }

  void ask(const GpuPairs& pairs, OrderOnGpu) override {
    const Status status = query_.find_contacts(instances(), pairs, options_, stream());
    if (subject(status) != nullptr) require(status, query_.report().where);
    check(status, query_.cuda_error(), "contacts");
    times_.triangle_tests = 1e-3 * static_cast<double>(query_.report().triangle_ms);
  }

  GpuContacts found() override {
    counters_ = query_.report().counters;
    return {query_.contacts(), counters_.contacts};
  }

  std::function<void()> repeatable(const GpuPairs& pairs, OrderOnGpu order, const Before& before) override {
    return [=, this] {
      before(cudaEventRecordDefault);
      ask(pairs, order);
    };
  }

  std::size_t query_bytes() const override { return query_.bytes(); }

  bench::PaperOptions options_;
  bench::PaperEngine query_;
};

}  // namespace

std::unique_ptr<Engine> make_paper(const ContactOptions& options) {
  return std::make_unique<PaperSchemeEngine>("paper", bench::PaperFlags::words, options.mode);
}

std::unique_ptr<Engine> make_paper_bits(const ContactOptions& options) {
  return std::make_unique<PaperSchemeEngine>("paper-bits", bench::PaperFlags::bits, options.mode);
}

}  // namespace tandem
