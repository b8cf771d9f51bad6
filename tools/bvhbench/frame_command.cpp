#include <cstdio>

#include "bvhbench/scenes/hdf5_file.h"
#include "bvhbench/simulator/run_file.h"
#include "command.h"
#include "common/number_words.h"

namespace tandem::bench {
namespace {

struct FrameArguments : CommonArguments {
  std::string run;
  std::uint32_t frame = 0;
};

ExitCode run_frame(const FrameArguments& arguments) {
  keep_inputs(arguments.output, {arguments.run});
  const simulation::StoredFrame frame = simulation::read_frame(arguments.run, arguments.frame);
  SceneDescription scene;
  for (const std::string& asset : frame.assets)
    scene.assets.push_back(seen_from(arguments.output, beside(arguments.run, asset)));
  scene.instances = frame.poses;
  scene.level = frame.level;
  scene.filter.motion = frame.motion;
  Hdf5Output file(arguments.output);
  add_scene(file, scene);
  add_motion(file, frame.moving);
  file.write();
  std::printf("%s: %s instances after step %u of %s\n", arguments.output.c_str(),
              with_commas(scene.instances.size()).c_str(), arguments.frame, arguments.run.c_str());
  return kDone;
}

}  // namespace

void add_frame(Command tool, Run& run_later) {
  const auto [command, arguments] = add_command<FrameArguments>(
      tool, run_later, "frame", "save a kept state of a simulation, with its motion, as a scene file",
      run_frame);
  command.add({required({"RUN", arguments.run, "", "file of a simulation with a trajectory", file_name()}),
               required({"--frame", arguments.frame, "K", "steps made before the state; 0: the start"}),
               required(output_option(arguments, "the scene file to write; appears whole or not at all",
                                      "-o,--output"))});
}

}  // namespace tandem::bench
