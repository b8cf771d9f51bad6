#include "frame_command.h"

#include <cstdio>
#include <filesystem>
#include <memory>

#include "bvhbench/scenes/scene_file.h"
#include "bvhbench/simulator/run_file.h"
#include "common/number_words.h"

namespace tandem::bench {
namespace {

struct FrameArguments {
  std::string run, output;
  std::uint32_t frame = 0;
};

ExitCode run(const FrameArguments& arguments) {
  keep_inputs(arguments.output, {arguments.run});
  const simulation::StoredFrame frame = simulation::read_frame(arguments.run, arguments.frame);
  SceneDescription scene;
  for (const std::string& asset : frame.assets) {
    const auto path = std::filesystem::path(arguments.run).parent_path() / asset;
    scene.assets.push_back(seen_from(arguments.output, path.string()));
  }
  scene.instances = frame.poses;
  scene.level = frame.level;
  write_scene(arguments.output, scene);
  std::printf("%s: %s instances after step %u of %s\n", arguments.output.c_str(),
              with_commas(scene.instances.size()).c_str(), arguments.frame, arguments.run.c_str());
  return kDone;
}

}  // namespace

CLI::App* add_frame(CLI::App& app, Run& run_later) {
  const auto arguments = std::make_shared<FrameArguments>();
  CLI::App* command = app.add_subcommand("frame", "save a kept state of a simulation as a scene file");
  command->add_option("RUN", arguments->run, "file of a simulation with a trajectory")
      ->required()
      ->check(file_name());
  command->add_option("--frame", arguments->frame, "steps made before the state; 0: the start")
      ->required()
      ->option_text("K");
  command
      ->add_option("-o,--output", arguments->output, "the scene file to write; appears whole or not at all")
      ->required()
      ->check(file_name());
  command->final_callback([arguments, &run_later] { run_later = [arguments] { return run(*arguments); }; });
  return command;
}

}  // namespace tandem::bench
