// Every name of a status is its own and has words; nothing else to link, so this also shows that the headers
// stand alone.
#include <gtest/gtest.h>

#include <set>
#include <string>

#include "tandem/formats/status.h"

namespace tandem {
namespace {

TEST(Status, EveryDefectHasANameAndASentenceOfItsOwn) {
  std::set<std::string> names, sentences;
  for (std::uint32_t i = 0; i <= static_cast<std::uint32_t>(Status::kCudaFailed); ++i) {
    const auto status = static_cast<Status>(i);
    EXPECT_TRUE(names.insert(name(status)).second) << name(status);
    EXPECT_TRUE(sentences.insert(explain(status)).second) << explain(status);
    EXPECT_STRNE(name(status), "Unnamed") << i;
  }
}

TEST(Status, ANumberOutsideTheEnumerationDoesNoHarm) {
  EXPECT_STREQ(name(static_cast<Status>(9999)), "Unnamed");
  EXPECT_EQ(subject(static_cast<Status>(9999)), nullptr);
}

}  // namespace
}  // namespace tandem
