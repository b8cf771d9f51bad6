# The program for a GPU that docs/c_gpu.md names finds the contacts of two cubes, or says that there is no GPU. Variables: SOURCE, FOLDER (to work in),
# BVHBUILD, EXAMPLE.

file(MAKE_DIRECTORY ${FOLDER})
execute_process(COMMAND ${BVHBUILD} ${SOURCE}/assets/box_12.obj -o ${FOLDER}/box.bvh --quiet COMMAND_ERROR_IS_FATAL ANY)
execute_process(COMMAND ${EXAMPLE} ${FOLDER}/box.bvh RESULT_VARIABLE code OUTPUT_VARIABLE output)
if(NOT (code EQUAL 0 AND output STREQUAL "52 pairs of triangles meet\n") AND
   NOT (code EQUAL 1 AND output STREQUAL "there is no GPU that can be used\n"))
  message(FATAL_ERROR "the example says: ${code}, ${output}")
endif()
execute_process(COMMAND ${EXAMPLE} ${SOURCE}/README.md RESULT_VARIABLE code OUTPUT_VARIABLE output)
if(NOT code EQUAL 1 OR NOT output STREQUAL "not a Tandem .bvh file\n")
  message(FATAL_ERROR "the example says of a file that is no tree: ${code}, ${output}")
endif()
