# Compiles variant_check for 64-bit Arm with Debian's cross compiler, runs it under qemu, and compares what it prints
# with what it prints here. Variables: SOURCE, FOLDER (to work in), COMPILER, QEMU, NATIVE (variant_check of this machine).
cmake_minimum_required(VERSION 3.25)

if(NOT COMPILER OR NOT QEMU)
  message("skipped: g++-aarch64-linux-gnu and qemu-user-static are not both here")
  return()
endif()

# The line that variant_check prints, less the number of comparisons, of which each machine makes its own.
function(hash_of result)
  execute_process(COMMAND ${ARGN} RESULT_VARIABLE code OUTPUT_VARIABLE output ERROR_VARIABLE errors)
  if(NOT code EQUAL 0)
    message(FATAL_ERROR "${ARGN}: ${code}\n${output}${errors}")
  endif()
  string(REGEX REPLACE ", [0-9]+ comparisons.*" "" output "${output}")
  set(${result} "${output}" PARENT_SCOPE)
endfunction()

file(MAKE_DIRECTORY ${FOLDER})
set(sources tests/kernels/common/variant_check.cpp formats/src/allocator.cpp formats/src/box.cpp kernels/common/available_memory_linux.cpp
  kernels/common/available_memory_of_machine.cpp kernels/common/block_pair.cpp kernels/variants/lanes4.cpp
  kernels/contact/narrow_phase.cpp kernels/distance/nearest_phase.cpp kernels/manifold/single_pieces.cpp)
list(TRANSFORM sources PREPEND ${SOURCE}/)
execute_process(COMMAND ${COMPILER} -std=c++20 -O1 -ffp-contract=off -static -I${SOURCE}/kernels/include -I${SOURCE}/formats/include
  -I${SOURCE} -I${SOURCE}/tests -I${SOURCE}/tests/kernels ${sources} -o ${FOLDER}/variant_check
  RESULT_VARIABLE code ERROR_VARIABLE errors)
if(NOT code EQUAL 0)
  message(FATAL_ERROR "${COMPILER}: ${code}\n${errors}")
endif()
hash_of(here ${NATIVE} 1500)
hash_of(there ${QEMU} ${FOLDER}/variant_check 1500)
message("here:   ${here}\non Arm: ${there}")
if(NOT here STREQUAL there)
  message(FATAL_ERROR "contacts on 64-bit Arm differ from those of this machine")
endif()
