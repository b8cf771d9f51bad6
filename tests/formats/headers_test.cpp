// Every name of a status is its own and has words; nothing else to link, so this also shows that the headers
// stand alone.
#include <gtest/gtest.h>

#include <fstream>
#include <regex>
#include <set>
#include <string>

#include "tandem/formats/status.h"

namespace tandem {
namespace {

// The enumerators, as the header has them.
std::set<std::string> declared_names() {
  std::ifstream file(TANDEM_SOURCE_DIR "/formats/include/tandem/formats/status.h");
  const std::regex enumerator("\\bk([A-Z]\\w*)( = \\d+)?,");
  std::set<std::string> names;
  for (std::string line; std::getline(file, line);) {
    const std::string code = line.substr(0, line.find("//"));
    for (std::sregex_iterator found(code.begin(), code.end(), enumerator), end; found != end; ++found)
      EXPECT_TRUE(names.insert((*found)[1]).second) << line;
  }
  return names;
}

TEST(Status, EveryDefectHasANameAndASentenceOfItsOwn) {
  std::set<std::string> names, sentences;
  for (std::uint32_t i = 0; i <= static_cast<std::uint32_t>(Status::kCudaFailed); ++i) {
    const auto status = static_cast<Status>(i);
    if (std::string(name(status)) == "Unnamed") continue;
    EXPECT_TRUE(names.insert(name(status)).second) << name(status);
    EXPECT_TRUE(sentences.insert(explain(status)).second) << explain(status);
  }
  EXPECT_EQ(names, declared_names());
  EXPECT_GT(names.size(), 70u);
}

TEST(Status, ANumberOutsideTheEnumerationDoesNoHarm) {
  EXPECT_STREQ(name(static_cast<Status>(9999)), "Unnamed");
  EXPECT_EQ(subject(static_cast<Status>(9999)), nullptr);
}

}  // namespace
}  // namespace tandem
