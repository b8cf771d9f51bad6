# Installs the libraries with every package of the tools out of reach, builds the consumer against the installation and
# runs it on a file that bvhbuild writes. Variables: SOURCE, FOLDER (to work in), COMPILER, GENERATOR, BVHBUILD.
cmake_minimum_required(VERSION 3.25)

function(run)
  execute_process(COMMAND ${ARGN} RESULT_VARIABLE code OUTPUT_VARIABLE output ERROR_VARIABLE output)
  if(NOT code EQUAL 0)
    message(FATAL_ERROR "${ARGN}: ${code}\n${output}")
  endif()
  set(output "${output}" PARENT_SCOPE)
endfunction()

# Whether a page shows a text as it is, between fences.
function(require_shown page language text)
  file(READ ${SOURCE}/${page} shown)
  string(FIND "${shown}" "```${language}\n${text}```" place)
  if(place EQUAL -1)
    message(FATAL_ERROR "${page} does not show:\n${text}")
  endif()
endfunction()

file(READ ${SOURCE}/tests/consumer/main.cpp program)
require_shown(README.md cpp "${program}")
file(READ ${SOURCE}/tests/consumer/contacts.cpp program)
require_shown(docs/queries.md cpp "${program}")
file(READ ${SOURCE}/tests/consumer/game_loop.cpp program)
require_shown(docs/contacts.md cpp "${program}")

file(READ ${SOURCE}/tests/consumer/impact.cpp program)
require_shown(docs/impact.md cpp "${program}")

file(REMOVE_RECURSE ${FOLDER})
foreach(package assimp CGAL CLI11 CUDAToolkit GTest HDF5 nlohmann_json TBB)
  list(APPEND no_packages -DCMAKE_DISABLE_FIND_PACKAGE_${package}=ON)
endforeach()
run(${CMAKE_COMMAND} -S ${SOURCE} -B ${FOLDER}/build -G ${GENERATOR} -DCMAKE_CXX_COMPILER=${COMPILER} ${no_packages}
  -DTANDEM_TOOLS=OFF -DTANDEM_TESTS=OFF -DTANDEM_CUDA=OFF -DTANDEM_WARNINGS_AS_ERRORS=ON)
run(${CMAKE_COMMAND} --build ${FOLDER}/build)
run(${CMAKE_COMMAND} --install ${FOLDER}/build --prefix ${FOLDER}/prefix)

run(${CMAKE_COMMAND} -S ${SOURCE}/tests/consumer -B ${FOLDER}/consumer -G ${GENERATOR} -DCMAKE_CXX_COMPILER=${COMPILER} ${no_packages}
  -DCMAKE_PREFIX_PATH=${FOLDER}/prefix)
run(${CMAKE_COMMAND} --build ${FOLDER}/consumer)

run(${BVHBUILD} ${SOURCE}/assets/box_12.obj -o ${FOLDER}/box.bvh --quiet)
run(${FOLDER}/consumer/consumer ${FOLDER}/box.bvh)
if(NOT output STREQUAL "12 triangles in 4 blocks\n")
  message(FATAL_ERROR "the consumer says: ${output}")
endif()
execute_process(COMMAND ${FOLDER}/consumer/consumer ${SOURCE}/README.md RESULT_VARIABLE code OUTPUT_VARIABLE output)
if(NOT code EQUAL 1 OR NOT output STREQUAL "${SOURCE}/README.md: not a Tandem .bvh file\n")
  message(FATAL_ERROR "the consumer says of a file that is no tree: ${code}, ${output}")
endif()
run(${FOLDER}/consumer/contacts ${FOLDER}/box.bvh)
require_shown(docs/queries.md "" "${output}")
run(${FOLDER}/consumer/impact ${FOLDER}/box.bvh)
require_shown(docs/impact.md "" "${output}")
run(${FOLDER}/consumer/game_loop ${FOLDER}/box.bvh)
if(NOT output MATCHES "\nall are asleep after [0-9]+ steps\n$")
  message(FATAL_ERROR "the game loop says: ${output}")
endif()
