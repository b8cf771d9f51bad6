#include <memory>

#include "bvhbench/engines/gpu_contacts.h"
#include "paper_engine.h"

namespace tandem {
namespace {

/// The paper's scheme, which asks the CPU after each level of the trees.
class PaperSchemeEngine final : public GpuContactEngine {
 public:
  PaperSchemeEngine(std::string_view name, bench::PaperFlags flags, QueryMode mode)
      : GpuContactEngine(name, {.contents = Contents::all}), options_{.mode = mode, .flags = flags} {}

 private:
  void name_shapes() override {
    const Status status = query_.set_assets(shapes(), stream());
    check(status, query_.cuda_error(), "assets");
  }

  void ask(const GpuPairs& pairs, OrderOnGpu) override {
    const Status status = query_.find_contacts(instances(), pairs, options_, stream());
    check(status, query_, "contacts");
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

std::unique_ptr<Engine> make_paper(std::string_view name, const Question& question) {
  const auto flags = name == "paper-bits" ? bench::PaperFlags::bits : bench::PaperFlags::words;
  return std::make_unique<PaperSchemeEngine>(name, flags, std::get<ContactOptions>(question).mode);
}

}  // namespace tandem
