#include "options.h"

#include <map>
#include <string>

#include "common/command_line.h"
#include "common/number_words.h"

namespace tandem::build {
namespace {

const std::map<std::string, Effort> kEffortNames = {
    {"fast", Effort::fast}, {"default", Effort::standard}, {"best", Effort::best}};
const std::map<std::string, Reader> kReaderNames = {
    {"auto", Reader::automatic}, {"tandem", Reader::tandem}, {"assimp", Reader::assimp}};

constexpr const char* kFooter =
    R"(MESH and the output are files: there is no reading from standard input, nor writing to standard output.
Exit codes: 0 done, 1 usage, 2 input could not be read (or --strict found something),
3 input holds no usable triangle, 4 output could not be written, 5 internal error.

Example: bvhbuild cow.obj -o cow.bvh && bvhinfo cow.bvh)";

// "minimal", "free" or a number from 0 to 1; false if it is none of them.
bool parse_imaginary(const std::string& text, Imaginary& imaginary) {
  if (text == "minimal" || text == "free") {
    imaginary = text == "free" ? Imaginary::free : Imaginary::minimal;
    return true;
  }
  imaginary.share = number_in(text).value_or(-1);
  return imaginary.share >= 0 && imaginary.share <= 1;
}

std::string imaginary_defect(const std::string& text) {
  Imaginary imaginary;
  return parse_imaginary(text, imaginary) ? "" : text + " is not minimal, free or a number from 0 to 1";
}

std::string level_errors_defect(const std::string& text) {
  std::vector<LevelError> errors;
  return parse_level_errors(text, errors);
}

void add_options(const Tool& tool, Options& options, double& memory_gib, double& expansion) {
  tool.add(
      {required({"MESH", options.input, "",
                 "mesh file: OBJ, PLY, STL, OFF, glTF/GLB, DAE and what else assimp reads", file_name()}),
       required({"-o,--output", options.output, "", "the .bvh file to write; appears whole or not at all",
                 file_name()}),
       {"--imaginary", [&options](const std::string& text) { parse_imaginary(text, options.imaginary); },
        "minimal|free|SHARE [minimal]",
        "padding nodes: 'minimal' (the proven fewest), 'free', or at most a share of all nodes",
        imaginary_defect},
       {"--effort", options.effort, kEffortNames, "fast|default|best [default]",
        "time that goes into a tree that is cheap to query; 'best' takes minutes for 100,000 triangles, and "
        "Ctrl-C ends it with the best tree so far"},
       {"--no-gpu-blocks", OptionRow::Cleared{options.gpu_blocks},
        "leave out the oriented blocks, which exact queries on a GPU walk; the file is a quarter smaller"},
       {"--no-topology", OptionRow::Cleared{options.topology},
        "leave out how triangles hang together, which contact manifolds need: 16 bytes a triangle"},
       {"--no-refit", OptionRow::Cleared{options.refit},
        "leave out what refitting the tree to a bent mesh needs: 4 bytes a vertex and 4 a block"},
       {"--levels", [&options](const std::string& text) { parse_level_errors(text, options.levels); },
        "E1,E2,...|auto",
        "coarser levels of the mesh, each proved to be at most so far from the finest: lengths, or with % of "
        "the diagonal of its bounds, ascending; 'auto' is 0.1%,0.3%,1%,3%",
        level_errors_defect},
       {"--animation", options.animation,
        "make the tree for the mean over the animations of a glTF file, skins and morph targets included"},
       {"--samples", options.samples, "N [8]",
        "samples of the animations that the tree is made for; the rest pose is one of them",
        between(2, kMostTreeSamples)},
       {"--poses", options.poses, "FILE...",
        "make the tree for the mean over MESH and these files, which have the same faces", file_name()},
       {"--strict", options.strict, "take anything dropped or found amiss in the mesh for an error"},
       {"--json", options.json, "print the report as JSON"},
       {"-q,--quiet", options.quiet, "print nothing but errors"},
       {"--threads", options.threads, "N [all]", "threads for building; the result does not depend on them",
        between(1, 4096)},
       {"--reader", options.import.reader, kReaderNames, "auto|tandem|assimp [auto]", "who reads the mesh"},
       {"--allow-outside-files", options.import.limits.outside_files,
        "let MESH name files elsewhere than in its folder and below it, such as buffers of glTF"},
       {"--time-limit", options.import.time_limit_seconds, "S [120]", "seconds that assimp may take",
        between(0.01, 1e6)},
       {"--memory-limit", memory_gib, "GIB [8]", "GiB of memory that reading may take", between(0.1, 1e6)},
       {"--expansion-limit", expansion, "N [4000000]",
        "vertices and faces that a scene may have beyond what the bytes of its file can hold: instances "
        "repeat meshes, and counts may promise what is not there",
        between(0, 1e15)}});
  tool.need("--samples", "--animation");
  tool.exclude("--poses", "--animation");
  for (const char* moving : {"--animation", "--poses"}) tool.exclude("--levels", moving);
  tool.end_help(kFooter);
}

}  // namespace

std::optional<Options> parse_options(int argc, char** argv, ExitCode& exit_code) {
  const Tool tool(
      "bvhbuild",
      "Turns a mesh into an optimised 4-ary blocked AABB tree for exact tandem collision queries.",
      TANDEM_VERSION);
  Options options;
  double memory_gib = static_cast<double>(options.import.limits.memory_bytes) / 0x1p30;
  auto expansion = static_cast<double>(options.import.limits.expansion);
  add_options(tool, options, memory_gib, expansion);
  if (!tool.parse(argc, argv, exit_code)) return std::nullopt;
  options.import.limits.memory_bytes = static_cast<std::uint64_t>(memory_gib * 0x1p30);
  options.import.limits.expansion = static_cast<std::uint64_t>(expansion);
  return options;
}

std::string name(Imaginary imaginary) {
  if (imaginary == Imaginary::minimal) return "minimal";
  return imaginary == Imaginary::free ? "free" : format("%g", imaginary.share);
}

std::string name(Effort effort) {
  return name_of(effort, kEffortNames);
}

}  // namespace tandem::build
